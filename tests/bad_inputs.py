"""What a user can get wrong, as a table: a scene or a file, and the words that the message must hold."""

from dataclasses import dataclass, field

import numpy as np

FREE = """
title = "a test"
[vehicle]
parameters = "itwm_drift"
[run]
duration = 0.1
step = 0.001
"""
FORCED = (
    FREE
    + """
[effects.wheel_forces]
file = "forces.csv"
interpolation = "held"
"""
)
GUIDED = (
    FORCED.replace("held", "linear")
    + """
[effects.prescribed_pitch]
file = "pitch.csv"
"""
)
ON_ROAD = (
    FREE
    + """
[effects.road]
source = "study"
speed = 20.0
"""
)
ON_CSV = (
    FREE
    + """
[effects.road]
source = "csv"
file = "road.csv"
beyond_end = "refused"
speed = 20.0
"""
)
ON_CRG = ON_CSV.replace("csv", "opencrg").replace("road.opencrg", "road.crg")
OWN_SET = FREE.replace("itwm_drift", "mine.toml")


def table(header: str, rows: np.ndarray) -> str:
    """CSV text."""
    return "\n".join([header, *(",".join(f"{value:.12g}" for value in row) for row in rows), ""])


TIME = 1e-3 * np.arange(151)
GOOD_FORCES = table("time [s],front [N],rear [N]", np.column_stack([TIME, 4e3 + 90 * TIME, 3.5e3 - 90 * TIME]))
GOOD_PITCH = table("time [s],pitch [rad]", np.column_stack([TIME, 0.01 * TIME**2]))
GOOD_ROAD = table("s [m],left [mm],right [mm]", np.column_stack([0.2 * np.arange(60)] + 2 * [np.sin(np.arange(60.0))]))
GOOD_SET = """a = 1.0
b = 1.0
m1 = 15.0
m2 = 15.0
m3 = 750.0
I = 500.0
k1 = 2e5
k2 = 2e5
k3 = 1e5
k4 = 1e5
d1 = 2e2
d2 = 2e2
d3 = 1e4
d4 = 1e4
"""
GOOD = {"forces.csv": GOOD_FORCES, "pitch.csv": GOOD_PITCH, "road.csv": GOOD_ROAD, "mine.toml": GOOD_SET}
"""Sound files, which a case replaces one at a time."""


@dataclass(frozen=True)
class Bad:
    """args follow ``run ride.toml``; files are written beside the scene, None removes a good one."""

    id: str
    scene: str | bytes
    words: tuple[str, ...]
    args: tuple[str, ...] = ()
    files: dict[str, str | bytes | None] = field(default_factory=dict)


def _set(id: str, change: str, *words: str, scene: str = FREE) -> Bad:
    return Bad(id, scene, words, ("--set", change))


def _forces(id: str, old: str, new: str, *words: str) -> Bad:
    assert old in GOOD_FORCES
    return Bad(id, FORCED, ("forces.csv", *words), files={"forces.csv": GOOD_FORCES.replace(old, new, 1)})


ROWS = GOOD_FORCES.splitlines(keepends=True)

SCENES = [
    Bad("unknown key at the top", FREE.replace("title", "titel"), ("ride.toml", "titel", "'a test'", "'title'")),
    Bad(
        "several at once", FREE.replace("title", "titel").replace("0.1", '"0.1"'), ("titel", "also wrong: run.duration")
    ),
    _set("unknown key in vehicle", "vehicle.geometri=exact", "vehicle.geometri", "'exact'", "did you mean 'geometry'?"),
    _set("unknown key in run", "run.durtion=1", "run.durtion = 1", "did you mean 'duration'?"),
    _set(
        "unknown key in an effect",
        "effects.road.sped=3",
        "effects.road.sped = 3",
        "did you mean 'speed'?",
        scene=ON_ROAD,
    ),
    _set(
        "unknown key in an effect without keys",
        "effects.contact_points.x=1",
        "contact_points.x",
        "takes none",
        scene=FORCED,
    ),
    _set("unknown key in an engine", "engines.exudyn.integratr=RK44", "engines.exudyn.integratr", "'integrator'?"),
    _set("an internal key", "folder=elsewhere", "folder = 'elsewhere'", "unknown key"),
    _set("misspelt effect", "effects.raod.speed=3", "effects.raod", "no such effect", "did you mean 'road'?"),
    _set("misspelt engine", "engines.exudin.step=0.001", "engines.exudin", "allowed: exudyn, mujoco", "mean 'exudyn'?"),
    _set("misspelt integrator", "engines.exudyn.integrator=RK45", "integrator = 'RK45'", "did you mean 'RK44'?"),
    _set("another engine's integrator", "engines.mujoco.integrator=rk44", "integrator = 'rk44'", "did you mean 'RK4'?"),
    _set("unimplemented integrator", "engines.exudyn.integrator=DVERK6", "engines.exudyn", "DVERK6", "use DOPRI5"),
    _set("tolerance of a fixed step", "engines.exudyn.tolerance=1e-6", "tolerance = 1e-06", "RK44", "fixed length"),
    _set("spectral radius elsewhere", "engines.mujoco.spectral_radius=0.5", "spectral_radius", "GeneralizedAlpha"),
    _set("misspelt source", "effects.road.source=stdy", "road.source = 'stdy'", "did you mean 'study'?", scene=ON_ROAD),
    _set("misspelt geometry", "vehicle.geometry=Exat", "vehicle.geometry = 'Exat'", "exact or linear", "mean 'exact'?"),
    _set("unknown system", "system=tyre", "system = 'tyre'", "no such system"),
    _set("unknown study", "study=single_rn", "study = 'single_rn'", "no such study", "did you mean 'single_run'?"),
    _set("option of a study that takes none", "options.seed=3", "options.seed = 3", "takes no options"),
    _set("negative mass", "vehicle.override.m3=-750", "vehicle.override.m3 = -750.0", "above 0", "in kg"),
    _set("zero inertia", "vehicle.override.I=0", "vehicle.override.I = 0.0", "above 0", "in kg m^2"),
    _set("unknown parameter", "vehicle.override.k5=1e5", "vehicle.override.k5 = 100000.0", "unknown key", "k1, k2, k3"),
    _set("springs that cannot carry", "vehicle.override.k3=10", "vehicle", "no static equilibrium", "too soft"),
    _set("misspelt parameter set", "vehicle.parameters=itwm_drft", "vehicle.parameters", "did you mean 'itwm_drift'?"),
    _set("NaN", "run.duration=nan", "run.duration = nan", "finite number", "length of the run, in s"),
    _set("infinity", "start.z3=inf", "start.z3 = inf", "finite number"),
    _set("text for a number", "run.duration=long", "run.duration = 'long'", "must be a number"),
    _set("bool for a number", "run.duration=true", "run.duration = true", "must be a number"),
    _set("a number for text", "title=3", "title = 3", "must be text in quotes"),
    _set("a table for a number", "run.step.x=3", "run.step is a value, not a table"),
    _set("a number for a table", "run=3", "run = 3", "must be a table of keys and values"),
    _set("a number for an effect", "effects.road=3", "effects.road = 3", "must be a table of keys and values"),
    _set("a huge whole number", "run.duration=1" + 400 * "0", "run.duration = 1000", "must be a"),
    _set(
        "fraction for a whole number", "effects.road.seed=1.5", "effects.road.seed = 1.5", "whole number", scene=ON_ROAD
    ),
    _set("unknown state", "start.pich=0.1", "start.pich = 0.1", "not a state", "did you mean 'pitch'?"),
    _set("zero step", "run.step=0", "run.step = 0", "above 0"),
    _set("endless run", "run.duration=1e9", "run.duration = 1000000000.0", "1e+12 steps", "at most 20,000,000"),
    _set("step that does not divide", "run.step=0.0007", "run.step = 0.0007", "divide run.duration = 0.1", "0.000625"),
    _set("an engine's step does not divide", "engines.mujoco.step=0.0003", "engines.mujoco.step = 0.0003", "0.00025"),
    _set("unstable step", "run.step=0.02", "RK4", "0.02", scene=ON_ROAD),
    _set("output step not a multiple", "run.output_step=0.0015", "run.output_step = 0.0015", "multiple of run.step"),
    _set("output step too long", "run.output_step=1", "run.output_step = 1", "at most run.duration"),
    _set("--set without =", "run.step", "--set = 'run.step'", "KEY=VALUE"),
    _set("--set without a key", "=3", "--set = '=3'", "KEY=VALUE"),
    _set("--set with half a key", "run..step=3", "--set = 'run..step=3'", "KEY=VALUE"),
    Bad(
        "wrong TOML",
        FREE.replace("duration =", "duration"),
        ("ride.toml", "line 6, column 10", "'duration 0.1'", "TOML"),
    ),
    Bad("key given twice", FREE + "duration = 3.0\n", ("ride.toml", "line 8", "not valid TOML")),
    Bad("nested too deeply", "x = " + 5000 * "[", ("ride.toml", "not valid TOML", "deep")),
    Bad("endless digits", FREE + "x = " + 5000 * "1", ("ride.toml", "not valid TOML", "digits")),
    Bad("no [run]", 'title = "a test"\n', ("ride.toml", "run", "is missing", "duration")),
    Bad("no duration", FREE.replace("duration = 0.1", ""), ("run.duration", "is missing", "length of the run, in s")),
    Bad("empty scene", "", ("ride.toml", "title", "is missing", "also wrong: run")),
    Bad("not UTF-8", FREE.encode("utf-16"), ("ride.toml", "byte 0", "UTF-8")),
]

COMMANDS = [
    Bad("absent scene file", FREE, ("rid.toml", "no such file", "did you mean 'ride.toml'?"), ("rid.toml",)),
    Bad("absent scene", FREE, ("scene = 'relase'", "did you mean 'release'?"), ("relase",)),
    Bad("name too long", FREE, ("scene = 'xxx", "no such scene"), ("x" * 5000,)),
    Bad("folder for a scene", FREE, ("results", "cannot be read", "directory"), ("results",)),
    Bad(
        "misspelt --engine",
        FREE,
        ("--engine = 'exudin'", "did you mean 'exudyn'?"),
        ("ride.toml", "--engine", "exudin"),
    ),
    Bad("--out holds files", FREE, ("--out = 'results'", "holds files"), ("ride.toml", "--out", "results")),
    Bad("--out is a file", FREE, ("--out = 'ride.toml'", "is a file"), ("ride.toml", "--out", "ride.toml")),
    Bad("--out below a file", FREE, ("--out = 'ride.toml/x'", "cannot be"), ("ride.toml", "--out", "ride.toml/x")),
    Bad("unknown option", FREE, ("--ot", "twinrig run --help"), ("ride.toml", "--ot", "x")),
    Bad("no scene", FREE, ("Missing argument 'scene'", "twinrig run --help"), ("--json",)),
    Bad("option without its value", FREE, ("--set", "requires an argument"), ("ride.toml", "--set")),
    Bad("two scenes", FREE, ("unexpected extra argument", "other"), ("ride.toml", "other")),
]

FORCES = [
    Bad(
        "no force file",
        FORCED,
        ("wheel_forces.file = 'forces.csv'", "no such file", "mean 'forces_1.csv'?"),
        files={"forces.csv": None, "forces_1.csv": GOOD_FORCES},
    ),
    Bad(
        "folder for a force file",
        FORCED.replace("forces.csv", "results"),
        ("wheel_forces.file = 'results'", "is a folder"),
    ),
    Bad("empty force file", FORCED, ("forces.csv", "empty"), files={"forces.csv": ""}),
    Bad("header alone", FORCED, ("forces.csv", "rows = 0", "at least 8"), files={"forces.csv": ROWS[0]}),
    Bad("binary force file", FORCED, ("forces.csv", "UTF-8"), files={"forces.csv": bytes(range(256))}),
    Bad("cut last line", FORCED, ("forces.csv", "line 152", "cut off"), files={"forces.csv": GOOD_FORCES[:-6]}),
    Bad(
        "forces too short",
        FORCED,
        ("ride.toml", "'forces.csv'", "ends at 0.05 s", "lasts 0.1 s", "shorten"),
        files={"forces.csv": "".join(ROWS[:51])},
    ),
    Bad(
        "unsorted times",
        FORCED,
        ("forces.csv", "line 4", "'time'", "must be greater"),
        files={"forces.csv": "".join([*ROWS[:2], ROWS[3], ROWS[2], *ROWS[4:]])},
    ),
    Bad(
        "repeated time",
        FORCED,
        ("forces.csv", "line 4", "must be greater"),
        files={"forces.csv": "".join([*ROWS[:3], *ROWS[2:]])},
    ),
    Bad(
        "a sample left out",
        FORCED,
        ("forces.csv", "row 40", "equally spaced", "0.039 is expected"),
        files={"forces.csv": "".join([*ROWS[:40], *ROWS[41:]])},
    ),
    Bad(
        "late start",
        FORCED,
        ("forces.csv", "first row", "at time 0"),
        files={"forces.csv": "".join([ROWS[0], *ROWS[3:]])},
    ),
    Bad(
        "row without a value",
        FORCED,
        ("forces.csv", "line 153", "3 values are needed, found 2"),
        files={"forces.csv": GOOD_FORCES + "0.151,4000\n"},
    ),
    _forces("jitter", "\n0.05,", "\n0.0501,", "row 51", "0.0501", "equally spaced"),
    _forces("NaN in forces", ",4000,", ",nan,", "line 2", "front", "'nan'", "finite number"),
    _forces("decimal comma", ",4000,", ",4000,5,", "line 2", "3 values are needed, found 4"),
    _forces("text in forces", ",4000,", ",much,", "line 2", "front", "'much'"),
    _forces("missing unit", "front [N]", "front", "header", "the unit is missing", "front [N]"),
    _forces("unknown unit", "front [N]", "front [lbf]", "'front', unit = 'lbf'", "allowed: N, kN"),
    _forces("unit in the wrong case", "front [N]", "front [KN]", "unit = 'KN'", "did you mean 'kN'?"),
    _forces("wrong column", "front [N]", "frnt [N]", "frnt", "did you mean 'front'?"),
    _forces("column twice", "rear [N]", "front [N]", "'front'", "appears twice"),
    Bad(
        "extra column",
        FORCED,
        ("forces.csv", "'left'", "not known"),
        files={
            "forces.csv": "\n".join(f"{row.strip()},{'left [N]' if i == 0 else 0}" for i, row in enumerate(ROWS)) + "\n"
        },
    ),
    _set(
        "interpolation not said",
        "effects.wheel_forces.frame=body",
        "interpolation",
        "is missing",
        scene=FORCED.replace('interpolation = "held"', ""),
    ),
    _set(
        "held period not divided",
        "run.step=0.0004",
        "reference",
        "0.0004",
        "sampling period 0.001 s",
        "0.00025",
        scene=FORCED,
    ),
    _set("adaptive steps over held samples", "engines.exudyn.integrator=DOPRI5", "DOPRI5", "cannot hold", scene=FORCED),
    _set("a road and wheel forces", "effects.road={source='study',speed=3}", "'road'", "drop one", scene=FORCED),
    _set(
        "pitch without forces",
        "effects.prescribed_pitch.file=pitch.csv",
        "prescribed_pitch",
        "needs the effect 'wheel_forces'",
    ),
    _set(
        "held samples beside a prescribed pitch",
        "effects.wheel_forces.interpolation=held",
        "exudyn",
        "half a step late",
        "linear",
        scene=GUIDED,
    ),
    _set("contact points on nothing", "effects.contact_points={}", "contact_points", "needs the effect 'wheel_forces'"),
    _set(
        "pitch spring and prescribed pitch",
        "effects.pitch_spring.stiffness=9",
        "pitch_spring",
        "drop one",
        scene=GUIDED,
    ),
    _set(
        "prescribed pitch and body frame",
        "effects.wheel_forces.frame=body",
        "frame = 'body'",
        "'inertial'",
        scene=GUIDED,
    ),
    _set(
        "explicit solver, prescribed pitch",
        "engines.exudyn.integrator=RK44",
        "engines.exudyn",
        "RK44",
        "use GeneralizedAlpha",
        scene=GUIDED,
    ),
    _set(
        "undamped multiplier",
        "engines.exudyn.spectral_radius=1.0",
        "engines.exudyn",
        "1.0",
        "at most 0.95",
        scene=GUIDED,
    ),
    Bad(
        "pitch in degrees without saying so",
        GUIDED,
        ("pitch.csv", "unit is missing", "pitch [rad]"),
        files={"pitch.csv": GOOD_PITCH.replace("pitch [rad]", "pitch")},
    ),
    Bad(
        "pitch too short",
        GUIDED,
        ("'pitch.csv'", "ends at 0.04", "shorten"),
        files={"pitch.csv": "".join(GOOD_PITCH.splitlines(keepends=True)[:42])},
    ),
]

ROADS = [
    _set("no speed", "effects.road={source='study'}", "effects.road.speed", "is missing", "in m/s"),
    _set("negative speed", "effects.road.speed=-3", "effects.road.speed = -3", "above 0", scene=ON_ROAD),
    _set(
        "key of another source",
        "effects.road.file=road.csv",
        "road.file = 'road.csv'",
        "no meaning",
        "gd",
        scene=ON_ROAD,
    ),
    _set("no road class", "effects.road.source=iso8608", "effects.road.road_class", "missing", scene=ON_ROAD),
    _set("class out of range", "effects.road={source='iso8608',road_class='I',speed=3}", "road_class = 'I'", "A or B"),
    _set("negative seed", "effects.road={source='iso8608',road_class='A',seed=-1,speed=3}", "seed = -1", "0 or more"),
    _set("no file", "effects.road={source='csv',beyond_end='refused',speed=3}", "effects.road.file", "missing", "csv"),
    _set("no rule for the end", "effects.road={source='csv',file='road.csv',speed=3}", "beyond_end", "missing"),
    _set(
        "road shorter than the run",
        "effects.road.speed=200",
        "beyond_end = 'refused'",
        "road.csv ends at 11.8 m",
        "20 m",
        "'mirrored'",
        scene=ON_CSV,
    ),
    _set(
        "run-in longer than the road", "effects.road.run_in=50", "effects.road.run_in = 50", "11.8 m long", scene=ON_CSV
    ),
    _set("track off the road", "effects.road.offset=9", "road.crg", "9.", "covers v = -0.75 to 0.75", scene=ON_CRG),
    _set("unknown track", "effects.road.track=lft", "road.track = 'lft'", "did you mean 'left'?", scene=ON_CSV),
    Bad("no road file", ON_CRG, ("road.file = 'road.crg'", "no such file"), files={"road.crg": None}),
    Bad(
        "road in inches",
        ON_CSV,
        ("road.csv", "'left', unit = 'in'", "allowed: cm, m, mm"),
        files={"road.csv": GOOD_ROAD.replace("left [mm]", "left [in]")},
    ),
    Bad("a csv called crg", ON_CRG, ("road.crg", "$KD_DEFINITION"), files={"road.crg": GOOD_ROAD}),
]

SETS = [
    Bad("own set: absent", OWN_SET, ("vehicle.parameters = 'mine.toml'", "no such file"), files={"mine.toml": None}),
    Bad(
        "own set: field missing",
        OWN_SET,
        ("mine.toml", "m3", "is missing", "kg"),
        files={"mine.toml": GOOD_SET.replace("m3 = 750.0", "")},
    ),
    Bad(
        "own set: misspelt field",
        OWN_SET,
        ("mine.toml", "m_3 = 750.0", "unknown key", "did you mean 'm3'?"),
        files={"mine.toml": GOOD_SET.replace("m3", "m_3")},
    ),
    Bad(
        "own set: negative stiffness",
        OWN_SET,
        ("mine.toml", "k1 = -200000.0", "above 0", "N/m"),
        files={"mine.toml": GOOD_SET.replace("k1 = ", "k1 = -")},
    ),
    Bad(
        "own set: wrong TOML",
        OWN_SET,
        ("mine.toml", "line 3", "TOML"),
        files={"mine.toml": GOOD_SET.replace("m1 =", "m1")},
    ),
]

CUTS = (0, 1, 10, 81, 200, 400, -1, -8, -80, -81)
"""Bytes at which an OpenCRG file is cut; negative ones count from its end."""

TABLE = [*SCENES, *COMMANDS, *FORCES, *ROADS, *SETS]
