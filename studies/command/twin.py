"""``twinrig twin``: a user's model file compared with twinrig's builds of it, or two model files compared."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from models.core.errors import InputError
from models.own_model.builds import sliding_states
from models.own_model.certificate import (
    CONSTRAINT_GAP,
    EQUAL_ACCELERATION_SHARE,
    Agreement,
    certificate,
    comparison_states,
    softness_difference,
)
from models.own_model.control_table import ControlTable, read_controls
from models.own_model.elements import ModelProperty, two_digit_text
from models.own_model.explain import ModelComparison, PropertyDifference, compare_models, removals_that_agree
from models.own_model.file import ModelFile, read_model_file
from models.own_model.limits import limits_struck
from models.own_model.names import first_names_text
from models.own_model.path import PathReport, compare_paths, step_count_of_path
from models.own_model.reading import TwinModel
from models.own_model.states import STATE_COUNT
from models.own_model.two_paths import PathGap, compare_two_paths
from models.own_model.urdf import MisreadNumber, misread_numbers

ReportProgress = Callable[[str, float], None]
"""Function that reports progress: the current task as text, and the finished share (0 to 1) of all work."""


def _ignore_progress(activity: str, share: float) -> None:
    """Report no progress."""


@dataclass(frozen=True)
class TwinOptions:
    """Options of the command ``twin``. states : number of random states at which accelerations are compared;
    compare_paths : whether runs in time are compared, too; tolerance (rad, m) and quantity for which the cheapest
    settings are sought, None for no search and for all joints; controls : file of the controls in these runs; folder :
    in which all files that a model names must lie, the model's own if None."""

    states: int = STATE_COUNT
    compare_paths: bool = True
    tolerance: float | None = None
    quantity: str | None = None
    controls: Path | None = None
    folder: Path | None = None


@dataclass(frozen=True, eq=False)
class ExaminedFile:
    """Results for a model file: the file as read, and the agreement of each build with it. explanations : for a build
    that disagrees, the elements that cause it; misread : numbers of a URDF that MuJoCo's parser changed; path :
    comparison of runs in time, None if not requested; price_lines : lines on the cost of accuracy; constraint_lines :
    lines on dry friction and constraints.
    """

    file: ModelFile
    agreements: tuple[Agreement, ...]
    explanations: dict[str, list[tuple[ModelProperty, float]]]
    misread: tuple[MisreadNumber, ...]
    path: PathReport | None
    price_lines: tuple[str, ...] = ()
    constraint_lines: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the model file."""
        return self.file.document.path.name

    @property
    def is_certified(self) -> bool:
        """Whether all builds agree with the file, and MuJoCo's parser changed nothing."""
        return all(agreement.alike for agreement in self.agreements) and not self.misread


@dataclass(frozen=True, eq=False)
class Twins:
    """Results of the command ``twin`` for one file or two. comparison : of the two files; path_gap : difference of
    their runs in time, None if not requested or if the files have different coordinates."""

    examined: tuple[ExaminedFile, ...]
    comparison: ModelComparison | None
    path_gap: PathGap | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the model files."""
        return tuple(examined_file.name for examined_file in self.examined)

    @property
    def alike(self) -> bool:
        """Whether all builds agree with their files, and both files with each other."""
        files = all(examined_file.is_certified for examined_file in self.examined)
        return files and (self.comparison is None or self.comparison.alike)


def check_arguments(files: Sequence[Path], page: Path | None) -> None:
    """Raise InputError for more than two files, or for a page that cannot be written."""
    if len(files) > 2:
        raise InputError("FILES", "", len(files), "files: one, or two to be compared")
    if page is None:
        return
    if page.exists():
        raise InputError("--page", "", str(page), "is there already, and nothing is overwritten: name another file")
    if not page.parent.is_dir():
        raise InputError("--page", "", str(page), "lies in a folder that does not exist")


def listed_content_kinds(text: str) -> tuple[str, ...]:
    """Names of kinds of model content in an option's text, separated by commas."""
    return tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))


def examine(
    files: Sequence[Path],
    without: Sequence[str],
    twin_options: TwinOptions,
    report_progress: ReportProgress = _ignore_progress,
) -> Twins:
    """Compare each model file with its builds, and both files if there are two; raises InputError if a file cannot be
    read or built.

    report_progress : called with the current task and the finished share of all work.
    """
    if twin_options.states < 1:
        raise InputError("--states", "", twin_options.states, "must be 1 or more")
    if twin_options.quantity is not None and twin_options.tolerance is None:
        raise InputError("--quantity", "", twin_options.quantity, "is what --tolerance is of: give both, or neither")
    if twin_options.controls and (
        not twin_options.compare_paths or twin_options.tolerance is not None or len(files) > 1
    ):
        allowed = "acts on paths of one file alone: leave out --no-paths, --tolerance and other files"
        raise InputError("--controls", "", str(twin_options.controls), allowed)
    read_files = [read_model_file(path, without, twin_options.folder) for path in files]
    for file in read_files if twin_options.compare_paths else ():
        step_count_of_path(file.twin)
    tables = [
        read_controls(twin_options.controls, file.twin.model) if twin_options.controls else None for file in read_files
    ]
    parts = len(files) + (len(files) > 1)
    examined = [
        _examine_file(file, table, twin_options, partial(_report_progress, report_progress, i, parts))
        for i, (file, table) in enumerate(zip(read_files, tables, strict=True))
    ]
    if len(examined) < 2:
        return Twins(tuple(examined), None)
    report_progress("comparing the files", len(files) / parts)
    first, second = (examined_file.file.twin for examined_file in examined)
    names = [examined_file.name for examined_file in examined]
    if names[0] == names[1]:
        names = [str(path) for path in files]
    comparison = compare_models(replace(first, name=names[0]), replace(second, name=names[1]))
    gap = (
        compare_two_paths(first, second)
        if twin_options.compare_paths and comparison.acceleration_agreement is not None
        else None
    )
    return Twins(tuple(examined), comparison, gap)


def _report_progress(
    report_progress: ReportProgress, file_number: int, file_count: int, activity: str, share: float
) -> None:
    """Report the progress within one model file as a share of the progress of all files."""
    report_progress(activity, (file_number + share) / file_count)


def _examine_file(
    file: ModelFile, table: ControlTable | None, twin_options: TwinOptions, report_progress: ReportProgress
) -> ExaminedFile:
    """Compare a model file with its builds, then its runs in time, and find its cheapest settings if requested. Each
    task counts as a third of the progress."""
    agreements = certificate(
        file.twin, twin_options.states, lambda share: report_progress("comparing accelerations", share / 3)
    )
    explained = {
        agreement.build: removals_that_agree(file.twin, agreement.build)
        for agreement in agreements
        if not agreement.alike
    }
    lost = misread_numbers(file) if file.document.kind == "URDF" else []
    report = None
    if twin_options.compare_paths:
        activity = f"marching {step_count_of_path(file.twin):,} steps by every build"
        report_progress(activity, 1 / 3)
        report = compare_paths(file.twin, None, table, lambda share: report_progress(activity, (1 + share) / 3))
    price: tuple[str, ...] = ()
    if twin_options.tolerance is not None:
        from models.advice.own_model_price import recommended_settings
        from models.advice.price.text import recommendation_lines as price_lines

        report_progress("pricing", 2 / 3)
        price = tuple(price_lines(recommended_settings(file.twin, twin_options.tolerance, twin_options.quantity)))
    return ExaminedFile(
        file, agreements, explained, tuple(lost), report, price, tuple(_constraint_lines(file, twin_options.states))
    )


def _constraint_lines(file: ModelFile, state_count: int) -> Iterator[str]:
    """Yield lines on joint limits that test states exceed, on dry friction, and on constraints, which are soft in
    MuJoCo, with the effect of the softness on accelerations."""
    twin = file.twin
    beyond = [limits_struck(twin)(q) for q, _ in comparison_states(twin, state_count)] if file.ignored_limits else []
    if any(beyond):
        names = dict.fromkeys(name for struck in beyond for name in struck)
        yield f"limits of {first_names_text(tuple(names))} would act at {sum(map(bool, beyond))} of the states"
    if twin.driven.frictions:
        yield _friction_line(twin, state_count)
    if twin.driven.tied:
        kinds = {"couplings of joints": twin.driven.couplings, "joints between bodies": twin.driven.connections}
        constraints_text = " and ".join(f"{len(rows)} {kind}" for kind, rows in kinds.items() if rows)
        yield (
            f"{constraints_text}: rigid in Exudyn and the plain equations, which are held to the file with rigid "
            "ones; soft in "
            f"MuJoCo, where accelerations are {two_digit_text(softness_difference(twin, state_count))} away from that"
        )


def _friction_line(twin: TwinModel, count: int) -> str:
    """Line on dry friction: the number of states at which builds are compared, and the law that each build is compared
    with."""
    states = comparison_states(twin, count)
    head = f"dry friction of {plural(len(twin.driven.frictions), 'joint')}: compared at {len(states)} of {count} states"
    if sliding_states(twin, states):
        return (
            f"{head}, at which all of it slides, with faster rates where it would not; where it sticks, MuJoCo's gives "
            "way"
        )
    return (
        f"{head}; in MuJoCo it sticks at all of them, however fast, and gives way: MuJoCo's build is held to that, "
        "Exudyn and the plain equations to the file with Coulomb's law"
    )


def plural(number: int, noun: str) -> str:
    """Text of a number with its noun, in the plural unless the number is 1."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def limits_sentence(names: Sequence[str]) -> str:
    """Sentence on the number of joints and tendons whose limits are not built; names : such as "joint hinge"."""
    sorts = {sort: sum(name.startswith(sort) for name in names) for sort in ("joint", "tendon")}
    told = " and ".join(plural(number, sort) for sort, number in sorts.items() if number)
    return f"limits of {told} are not built; states are drawn inside the ranges of joints"


def twin_lines(twins: Twins) -> list[str]:
    """Lines for the screen on all examined model files, and on their comparison."""
    rows = list[str]()
    for examined_file in twins.examined:
        rows += _file_lines(examined_file)
    rows += _comparison_lines(twins.comparison, twins.names) if twins.comparison is not None else []
    return rows + ([twins.path_gap.line()] if twins.path_gap is not None else [])


def verdict_sentence(examined_file: ExaminedFile) -> str:
    """Sentence with the verdict on a model file: whether its builds move as it does."""
    worst = max(row.acceleration for row in examined_file.agreements)
    if examined_file.misread:
        return f"MuJoCo's parser made something else of {plural(len(examined_file.misread), 'number')} of the file"
    if examined_file.is_certified:
        bound = max(row.bound for row in examined_file.agreements)
        said = f"; up to {bound:.0e} may be rounding" if bound > EQUAL_ACCELERATION_SHARE else ""
        return f"every build moves as the file does: accelerations differ by {two_digit_text(worst)} at the most{said}"
    builds = ", ".join(row.build for row in examined_file.agreements if not row.alike)
    return f"differs in {builds}: accelerations by {two_digit_text(worst)}"


def _file_lines(examined_file: ExaminedFile) -> list[str]:
    model, twin = examined_file.file.twin.model, examined_file.file.twin
    rows = [
        f"{examined_file.name}: {examined_file.file.document.kind}, {model.nbody - 1} bodies, "
        f"{plural(twin.size, 'coordinate')}, {plural(model.ntendon, 'tendon')}, {plural(model.nu, 'actuator')}",
        f"  {verdict_sentence(examined_file)}",
    ]
    for row in examined_file.agreements:
        largest_text = f"  differs most at {row.worst}: {row.difference:.3g} of {row.size:.3g}"
        gap_text = f"  its constraints are {two_digit_text(row.gap)} (m, rad) apart where those of the file meet"
        rows.append(
            f"    {row.build:7s} mass {two_digit_text(row.mass)}  forces {two_digit_text(row.force)}  "
            f"accelerations {two_digit_text(row.acceleration)}"
            f"{gap_text if row.gap > CONSTRAINT_GAP else ''}{'' if row.same_motion else largest_text}"
        )
    for build, elements in examined_file.explanations.items():
        said = ", ".join(f"{element.kind} of {element.owner}" for element, _ in elements[:3])
        rows.append(f"  {build}: {f'it is the {said}' if said else 'no single element explains it'}")
    rows += [f"  {lost.sentence()}" for lost in examined_file.misread]
    rows += [f"  left out: {content.line()}" for content in examined_file.file.removed_contents]
    if examined_file.file.ignored_limits:
        rows.append(f"  {limits_sentence(examined_file.file.ignored_limits)}")
    rows += [f"  {note}" for note in (*examined_file.constraint_lines, *examined_file.file.notes)]
    rows += [f"  {line}" for line in examined_file.path.lines()] if examined_file.path is not None else []
    return rows + [f"  {line}".rstrip() for line in examined_file.price_lines]


def _at_which_controls(difference: PropertyDifference) -> str:
    """Phrase on the controls at which an actuator's difference has no influence; "" for all other elements."""
    return " at controls of 0, or the nearest in range" if difference.owner.startswith("actuator ") else ""


def _comparison_lines(comparison: ModelComparison, names: Sequence[str]) -> list[str]:
    if comparison.acceleration_agreement is None:
        rows = ["the files have not the same coordinates:", *(f"  {text}" for text in comparison.unmatched_coordinates)]
        return rows + [f"  {difference.sentence(names)}" for difference in comparison.differences]
    agreement, influential = comparison.acceleration_agreement, comparison.influential
    head = "both files move alike" if comparison.alike else "the files do not move alike"
    rows = [
        f"{head}: accelerations differ by {two_digit_text(agreement.acceleration)}, most at {agreement.worst}; "
        f"mass matrices by {two_digit_text(agreement.mass)}"
    ]
    for difference in influential:
        size = (
            "cannot be tried"
            if difference.influence is None
            else f"changes accelerations or masses by {two_digit_text(difference.influence)}"
        )
        rows.append(f"  {difference.sentence(names)} ({size})")
    if not comparison.alike:
        rows.append(f"  {comparison.remainder_text()}")
    rows += [
        f"  without influence{_at_which_controls(difference)}: {difference.sentence(names)}"
        for difference in comparison.silent_differences
    ]
    return rows + [
        f"  not compared, since it is off or MuJoCo's alone: {difference.sentence(names)}"
        for difference in comparison.not_compared
    ]
