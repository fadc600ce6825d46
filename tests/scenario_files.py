"""Tables of muscle and scenario files that several tests write: a muscle with a braid, two valves at a supply."""

BRAID = '{ model = "Braid", radius = "10 mm", braid_angle = "25 deg", resting_length = "300 mm" }'
MUSCLE_FILE = f"""
title = "A braid"
provenance = "example"
geometry = {BRAID}
[characteristic]
model = "ChouHannaford1996"
geometry = {BRAID}
"""
CIRCUIT = """
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "5 bar" }
fill = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
discharge = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
"""
