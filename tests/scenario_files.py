"""Texts of muscle and scenario files that several tests use: a braid, two valves at a supply, a lift of the library."""

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
LIFT = """
[plant]
muscle = "dmsp-20-300"
circuit = { model = "FillDischarge", supply = { model = "Supply", pressure = "6 bar" }, fill = { library = "matrix-821" }, discharge = { library = "matrix-821" } }
mechanism = { model = "HangingMass", mass = "5 kg" }
[input]
fill = [["1 s", 1]]
[run]
duration = "2 s"
"""
