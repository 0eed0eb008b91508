"""Planted faults of the pitch-plane vehicle: which checks see them, on a symmetric and an asymmetric vehicle."""

import math
from collections.abc import Sequence

from validation.common.rows import Drawn, Observed, Row, Saved, Table
from validation.faults.bench import CHECKS, Bench, size_of_error
from validation.faults.campaign import FAULT_SYSTEM
from validation.faults.planting import (
    ADAPTER_FAULTS,
    CONTROLS_WITHOUT_FAULT,
    DESCRIPTION_FAULTS,
    EQUATIONS_FAULTS,
    FAULTS,
    INPUT_FAULTS,
    EngineFault,
    planted_builder,
)

ASYMMETRIC_SET, SYMMETRIC_SET = "asymmetric_twin", "itwm_drift"
RUN_DURATION = 0.1
"""Duration (s) of every run; the faults show at once."""
HIDDEN_BY_SYMMETRY = (
    "a and b swapped",
    "front and rear suspension swapped",
    "front and rear tyre swapped",
    "front and rear wheel mass swapped",
    "chassis row of eq. (39) with the other sign",
)
"""Faults that a vehicle with equal front and rear halves cannot show: exchanges of the halves, and terms in k3 b - k4
a."""


def measure(
    engine_faults: Sequence[EngineFault] = FAULTS,
    faultless_controls: Sequence[EngineFault] = CONTROLS_WITHOUT_FAULT,
    vehicle_names: Sequence[str] = (ASYMMETRIC_SET, SYMMETRIC_SET),
) -> Saved:
    """Records with the ratio of error to tolerance of every check on every vehicle: "clean" without faults, "faults"
    with each fault planted."""
    benches = [Bench(name, RUN_DURATION) for name in vehicle_names]
    return {
        name: [_error_ratios(fault, benches) for fault in planted_here]
        for name, planted_here in (("clean", faultless_controls), ("faults", engine_faults))
    }


def _error_ratios(engine_fault: EngineFault, benches: list[Bench]) -> Saved:
    """Record of a fault: ratio of error to tolerance by vehicle, engine and check; None for a refused or failed run."""
    ratios = {
        bench.parameter_set: {
            engine: {name: _error_ratio(engine_fault, engine, name, bench) for name in CHECKS}
            for engine in engine_fault.engines
        }
        for bench in benches
    }
    place_of_fault = next((name for name, group in FAULTS_BY_PLACE.items() if engine_fault in group), "nowhere")
    return {"fault": engine_fault.name, "place": place_of_fault, "engines": engine_fault.engines, "ratios": ratios}


def _error_ratio(engine_fault: EngineFault, engine: str, check_name: str, bench: Bench) -> float | None:
    check = CHECKS[check_name]
    ratio = size_of_error(check, bench, engine, planted_builder(engine_fault, engine)) / check.tolerance(engine)
    return ratio if math.isfinite(ratio) else None


FAULTS_BY_PLACE = {
    "description": DESCRIPTION_FAULTS,
    "input": INPUT_FAULTS,
    "adapter": ADAPTER_FAULTS,
    "equations": EQUATIONS_FAULTS,
}


def is_seen(fault_record: Saved, check_name: str, vehicle_name: str = ASYMMETRIC_SET) -> bool:
    """Whether a check sees the fault of a record on a vehicle, in every engine in which it is planted."""
    return all(ratio is None or ratio > 1 for ratio in _ratios_of_check(fault_record, check_name, vehicle_name))


def smallest_ratio(fault_record: Saved, check_name: str, vehicle_name: str) -> float:
    """Smallest ratio of error to tolerance of a check on a vehicle, over the engines; infinite for refused runs."""
    return min(
        math.inf if ratio is None else ratio for ratio in _ratios_of_check(fault_record, check_name, vehicle_name)
    )


def _ratios_of_check(fault_record: Saved, check_name: str, vehicle_name: str) -> list[float | None]:
    return [ratios[check_name] for ratios in fault_record["ratios"][vehicle_name].values()]


def is_caught(fault_record: Saved, vehicle_name: str = ASYMMETRIC_SET) -> bool:
    """Whether at least one check sees the fault of a record on a vehicle, in every engine in which it is planted."""
    engines = fault_record["ratios"][vehicle_name].values()
    return all(any(ratio is None or ratio > 1 for ratio in ratios.values()) for ratios in engines)


def rows(case_data: Saved) -> list[Row]:
    """Report rows: numbers of faults caught, of false alarms, of faults that the symmetric vehicle hides (if both
    vehicles ran), and of faults that a single check catches."""
    clean, faulty = case_data["clean"], case_data["faults"]
    alarms = sum(
        ratio is None or ratio > 1
        for record in clean
        for vehicle in record["ratios"].values()
        for ratios in vehicle.values()
        for ratio in ratios.values()
    )
    single = [record for record in faulty if sum(is_seen(record, name) for name in CHECKS) == 1]
    single_catches = [
        f"{record['fault']} ({next(name for name in CHECKS if is_seen(record, name))})" for record in single
    ]
    return [
        Observed(
            "planted.caught",
            FAULT_SYSTEM,
            "planted faults that a check catches, asymmetric vehicle",
            sum(map(is_caught, faulty)),
            "faults",
        ).within(
            len(faulty), 0, f"every one of them is a wrong model; {len(faulty)} of {len(FAULTS)} were planted", "native"
        ),
        Observed(
            "planted.false_alarms",
            FAULT_SYSTEM,
            "alarms without a fault, all checks, vehicles and implementations",
            alarms,
            "alarms",
        ).within(0, 0, "a check that cries without a fault is no check", "native"),
        *([_hidden_faults_row(faulty)] if _has_symmetric_vehicle(case_data) else []),
        Observed(
            "planted.single", FAULT_SYSTEM, "planted faults that a single check catches", len(single), "faults"
        ).beside(
            "few", "what would pass if that check were dropped: " + (", ".join(single_catches) or "none"), "native"
        ),
    ]


def _has_symmetric_vehicle(case_data: Saved) -> bool:
    """Whether the faults were measured on the symmetric vehicle, too."""
    return all(SYMMETRIC_SET in record["ratios"] for record in case_data["faults"])


def _hidden_faults_row(fault_records: list[Saved]) -> Row:
    missed = [record for record in fault_records if not is_caught(record, SYMMETRIC_SET)]
    why = "exchanges of front and rear, and terms in k3 b - k4 a: equal halves cannot show them"
    return Observed(
        "planted.hidden",
        FAULT_SYSTEM,
        "planted faults that the symmetric vehicle of the paper hides",
        len(missed),
        "faults",
    ).within(len(HIDDEN_BY_SYMMETRY), 0, why, "native")


def lines(case_data: Saved) -> list[tuple[str, ...]]:
    """Table lines, one for each fault: system, the part with the fault, fault, checks that see it, checks that do
    not."""
    return [
        (
            "pitch-plane",
            f"{record['place']} of the vehicle",
            record["fault"],
            ", ".join(name for name in CHECKS if is_seen(record, name)) or "none",
            ", ".join(name for name in CHECKS if not is_seen(record, name)),
        )
        for record in case_data["faults"]
    ]


def tables(case_data: Saved) -> list[Table]:
    """Report tables of the checks with their tolerances, and of every fault with the checks that see it."""
    return [_check_table(case_data), _fault_table(case_data)]


def _check_table(case_data: Saved) -> Table:
    lines = []
    for name, check in CHECKS.items():
        worst = max(
            ratio or 0.0
            for record in case_data["clean"]
            for vehicle in record["ratios"]
            for ratio in _ratios_of_check(record, name, vehicle)
        )
        catches = sum(is_seen(record, name) for record in case_data["faults"])
        limits = sorted({check.tolerance(engine) for engine in ("exudyn", "mujoco")})
        lines.append(
            (
                name,
                check.title,
                " / ".join(f"{limit:g}" for limit in limits),
                check.unit,
                check.why,
                f"{worst:.2g}",
                f"{catches} of {len(case_data['faults'])}",
            )
        )
    headings = ("check", "compares", "tolerance", "unit", "because", "worst without a fault", "faults seen")
    note = "Worst without a fault is size over tolerance: below 1 is quiet."
    return Table("The checks", note, headings, tuple(lines))


def _fault_table(case_data: Saved) -> Table:
    lines = tuple(
        (
            record["fault"],
            f"{record['place']} ({', '.join(record['engines'])})",
            ", ".join(f"{name} {_size_text(record, name)}" for name in CHECKS if is_seen(record, name)),
            ", ".join(name for name in CHECKS if not is_seen(record, name)) or "-",
            "not run" if not _has_symmetric_vehicle(case_data) else "no" if is_caught(record, SYMMETRIC_SET) else "yes",
        )
        for record in case_data["faults"]
    )
    note = (
        "Sizes on the asymmetric vehicle, in the unit of the check, the smaller one where a fault was planted in "
        "two engines. Each check in the fourth column, had it been the only one, would have let the fault pass."
    )
    return Table(
        "Every fault, one at a time",
        note,
        ("fault", "planted in", "caught by", "not seen by", "symmetric vehicle hides it"),
        lines,
    )


def _size_text(fault_record: Saved, check_name: str) -> str:
    """Text with a check's smallest error over the engines on the asymmetric vehicle, or "refused"."""
    sizes = [
        math.inf if ratios[check_name] is None else ratios[check_name] * CHECKS[check_name].tolerance(engine)
        for engine, ratios in fault_record["ratios"][ASYMMETRIC_SET].items()
    ]
    smallest_error = min(sizes)
    return (
        "refused"
        if smallest_error == math.inf
        else f"{smallest_error:.0e}"
        if smallest_error < 0.01
        else f"{smallest_error:.2g}"
    )


def draw(case_data: Saved) -> Drawn:
    """Figure of each check's error divided by its tolerance for every fault; none unless both vehicles ran."""
    if not _has_symmetric_vehicle(case_data):
        return []
    from validation.faults.figure import fault_map

    vehicles = {ASYMMETRIC_SET: "asymmetric vehicle", SYMMETRIC_SET: "symmetric vehicle (the paper's)"}
    records = case_data["faults"]
    depth = {
        vehicle: [[smallest_ratio(record, name, vehicle) for name in CHECKS] for record in records]
        for vehicle in vehicles
    }
    marks = [not is_caught(record, SYMMETRIC_SET) for record in records]
    figure = fault_map([record["fault"] for record in records], tuple(CHECKS), depth, vehicles, marks)
    caption = (
        "Decades between what a check finds and its tolerance; white: not seen. Left the asymmetric twin, right "
        f"the paper's vehicle, whose equal halves hide {sum(marks)} faults from every check (marked)."
    )
    return [(caption, figure)]
