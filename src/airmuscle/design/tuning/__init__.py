"""Tuning: gains of a controller for a family of plants, by one optimiser with one budget, in the batch engine.

    cases = [LoopCase("nominal", plant, loop), LoopCase("heavy", heavy_plant, loop)]
    tuning = tune(cases, {"gain": (5.0, 500.0), "integral_time": (0.05, 5.0)}, duration=5.0, budget=4000, seed=1)
    tuning.gains, tuning.objective, tuning.loop, tuning.history

`perturbed_family` makes the cases of a plant with other loads, supply pressures, a leak, a delay and drawn parameters;
`load_scenario_loop` reads them from a scenario file and writes it back with the gains that were found. `simc`,
`amigo_pi` and `amigo_pid` are settings by rules, from a process model that a step or a relay experiment identifies.

A `LoopCase` is a plant with its control loop and initial state. The cases differ in parameters or kind of the plant, in
set points, disturbances or sensors, but contain the same controller, whose parameters are named as by
`airmuscle.core.tree.leaves(controller)`: `gain`, `outer.gain`. A case whose controller encloses that of the first case,
such as a WithSensors, states the place of it: `controller_path="law"`.

Any Controller with declared parameters can be tuned: a ControlLaw is compiled, another one is called from Python. The
tracking index of a run (`RootMeanSquareError` by default) and the objective over the cases (`RobustObjective`) are
objects; an objective may also be any function from `CaseMetrics` to the values (E,) of E sets of gains.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
