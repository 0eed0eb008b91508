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


def _ignore_progress(task_text: str, finished_share: float) -> None:
    """Report no progress."""


@dataclass(frozen=True)
class TwinOptions:
    """Options of the command ``twin``. state_count : number of random states at which accelerations are compared;
    compare_paths : whether runs in time are compared, too; tolerance (rad, m) and quantity_name for which the cheapest
    settings are sought, None for no search and for all joints; controls_path : file of the controls in these runs;
    resource_folder : in which all files that a model names must lie, the model's own if None."""

    state_count: int = STATE_COUNT
    compare_paths: bool = True
    tolerance: float | None = None
    quantity_name: str | None = None
    controls_path: Path | None = None
    resource_folder: Path | None = None


@dataclass(frozen=True, eq=False)
class ExaminedFile:
    """Results for a model file: the file as read, and the agreement of each build with it. explanations : for a build
    that disagrees, the elements that cause it; misread_numbers : numbers of a URDF that MuJoCo's parser changed;
    path_report : comparison of runs in time, None if not requested; price_lines : lines on the cost of accuracy;
    constraint_lines : lines on dry friction and constraints.
    """

    file: ModelFile
    agreements: tuple[Agreement, ...]
    explanations: dict[str, list[tuple[ModelProperty, float]]]
    misread_numbers: tuple[MisreadNumber, ...]
    path_report: PathReport | None
    price_lines: tuple[str, ...] = ()
    constraint_lines: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the model file."""
        return self.file.document.path.name

    @property
    def is_certified(self) -> bool:
        """Whether all builds agree with the file, and MuJoCo's parser changed nothing."""
        return all(agreement.alike for agreement in self.agreements) and not self.misread_numbers


@dataclass(frozen=True, eq=False)
class TwinResults:
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


def check_arguments(model_paths: Sequence[Path], page_path: Path | None) -> None:
    """Raise InputError for more than two files, or for a page that cannot be written."""
    if len(model_paths) > 2:
        raise InputError("FILES", "", len(model_paths), "files: one, or two to be compared")
    if page_path is None:
        return
    if page_path.exists():
        raise InputError(
            "--page", "", str(page_path), "is there already, and nothing is overwritten: name another file"
        )
    if not page_path.parent.is_dir():
        raise InputError("--page", "", str(page_path), "lies in a folder that does not exist")


def listed_content_kinds(option_text: str) -> tuple[str, ...]:
    """Names of kinds of model content in an option's text, separated by commas."""
    return tuple(dict.fromkeys(name.strip() for name in option_text.split(",") if name.strip()))


def examine(
    model_paths: Sequence[Path],
    omitted_kinds: Sequence[str],
    twin_options: TwinOptions,
    report_progress: ReportProgress = _ignore_progress,
) -> TwinResults:
    """Compare each model file with its builds, and both files if there are two; raises InputError if a file cannot be
    read or built.

    report_progress : called with the current task and the finished share of all work.
    """
    if twin_options.state_count < 1:
        raise InputError("--states", "", twin_options.state_count, "must be 1 or more")
    if twin_options.quantity_name is not None and twin_options.tolerance is None:
        raise InputError(
            "--quantity", "", twin_options.quantity_name, "is what --tolerance is of: give both, or neither"
        )
    if twin_options.controls_path and (
        not twin_options.compare_paths or twin_options.tolerance is not None or len(model_paths) > 1
    ):
        allowed = "acts on paths of one file alone: leave out --no-paths, --tolerance and other files"
        raise InputError("--controls", "", str(twin_options.controls_path), allowed)
    read_files = [read_model_file(path, omitted_kinds, twin_options.resource_folder) for path in model_paths]
    for file in read_files if twin_options.compare_paths else ():
        step_count_of_path(file.twin)
    tables = [
        read_controls(twin_options.controls_path, file.twin.model) if twin_options.controls_path else None
        for file in read_files
    ]
    parts = len(model_paths) + (len(model_paths) > 1)
    examined = [
        _examine_file(file, table, twin_options, partial(_report_progress, report_progress, i, parts))
        for i, (file, table) in enumerate(zip(read_files, tables, strict=True))
    ]
    if len(examined) < 2:
        return TwinResults(tuple(examined), None)
    report_progress("comparing the files", len(model_paths) / parts)
    first, second = (examined_file.file.twin for examined_file in examined)
    names = [examined_file.name for examined_file in examined]
    if names[0] == names[1]:
        names = [str(path) for path in model_paths]
    comparison = compare_models(replace(first, name=names[0]), replace(second, name=names[1]))
    gap = (
        compare_two_paths(first, second)
        if twin_options.compare_paths and comparison.acceleration_agreement is not None
        else None
    )
    return TwinResults(tuple(examined), comparison, gap)


def _report_progress(
    report_progress: ReportProgress, file_number: int, file_count: int, task_text: str, finished_share: float
) -> None:
    """Report the progress within one model file as a share of the progress of all files."""
    report_progress(task_text, (file_number + finished_share) / file_count)


def _examine_file(
    model_file: ModelFile,
    control_table: ControlTable | None,
    twin_options: TwinOptions,
    report_progress: ReportProgress,
) -> ExaminedFile:
    """Compare a model file with its builds, then its runs in time, and find its cheapest settings if requested. Each
    task counts as a third of the progress."""
    agreements = certificate(
        model_file.twin, twin_options.state_count, lambda share: report_progress("comparing accelerations", share / 3)
    )
    explained = {
        agreement.build: removals_that_agree(model_file.twin, agreement.build)
        for agreement in agreements
        if not agreement.alike
    }
    lost = misread_numbers(model_file) if model_file.document.kind == "URDF" else []
    report = None
    if twin_options.compare_paths:
        activity = f"marching {step_count_of_path(model_file.twin):,} steps by every build"
        report_progress(activity, 1 / 3)
        report = compare_paths(
            model_file.twin, None, control_table, lambda share: report_progress(activity, (1 + share) / 3)
        )
    price: tuple[str, ...] = ()
    if twin_options.tolerance is not None:
        from models.advice.own_model_price import recommended_settings
        from models.advice.price.text import recommendation_lines as price_lines

        report_progress("pricing", 2 / 3)
        price = tuple(
            price_lines(recommended_settings(model_file.twin, twin_options.tolerance, twin_options.quantity_name))
        )
    return ExaminedFile(
        model_file,
        agreements,
        explained,
        tuple(lost),
        report,
        price,
        tuple(_constraint_lines(model_file, twin_options.state_count)),
    )


def _constraint_lines(model_file: ModelFile, state_count: int) -> Iterator[str]:
    """Yield lines on joint limits that test states exceed, on dry friction, and on constraints, which are soft in
    MuJoCo, with the effect of the softness on accelerations."""
    twin = model_file.twin
    beyond = (
        [limits_struck(twin)(q) for q, _ in comparison_states(twin, state_count)] if model_file.ignored_limits else []
    )
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


def _friction_line(twin_model: TwinModel, state_count: int) -> str:
    """Line on dry friction: the number of states at which builds are compared, and the law that each build is compared
    with."""
    states = comparison_states(twin_model, state_count)
    joints = plural(len(twin_model.driven.frictions), "joint")
    head = f"dry friction of {joints}: compared at {len(states)} of {state_count} states"
    if sliding_states(twin_model, states):
        return (
            f"{head}, at which all of it slides, with faster rates where it would not; where it sticks, MuJoCo's gives "
            "way"
        )
    return (
        f"{head}; in MuJoCo it sticks at all of them, however fast, and gives way: MuJoCo's build is held to that, "
        "Exudyn and the plain equations to the file with Coulomb's law"
    )


def plural(count: int, noun: str) -> str:
    """Text of a number with its noun, in the plural unless the number is 1."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def limits_sentence(joint_names: Sequence[str]) -> str:
    """Sentence on the number of joints and tendons whose limits are not built; joint_names : such as "joint hinge"."""
    sorts = {sort: sum(name.startswith(sort) for name in joint_names) for sort in ("joint", "tendon")}
    told = " and ".join(plural(number, sort) for sort, number in sorts.items() if number)
    return f"limits of {told} are not built; states are drawn inside the ranges of joints"


def twin_lines(twin_results: TwinResults) -> list[str]:
    """Lines for the screen on all examined model files, and on their comparison."""
    rows = list[str]()
    for examined_file in twin_results.examined:
        rows += _file_lines(examined_file)
    rows += (
        _comparison_lines(twin_results.comparison, twin_results.names) if twin_results.comparison is not None else []
    )
    return rows + ([twin_results.path_gap.line()] if twin_results.path_gap is not None else [])


def verdict_sentence(examined_file: ExaminedFile) -> str:
    """Sentence with the verdict on a model file: whether its builds move as it does."""
    worst = max(row.acceleration for row in examined_file.agreements)
    if examined_file.misread_numbers:
        return (
            f"MuJoCo's parser made something else of {plural(len(examined_file.misread_numbers), 'number')} of the file"
        )
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
    rows += [f"  {lost.sentence()}" for lost in examined_file.misread_numbers]
    rows += [f"  left out: {content.line()}" for content in examined_file.file.removed_contents]
    if examined_file.file.ignored_limits:
        rows.append(f"  {limits_sentence(examined_file.file.ignored_limits)}")
    rows += [f"  {note}" for note in (*examined_file.constraint_lines, *examined_file.file.notes)]
    rows += [f"  {line}" for line in examined_file.path_report.lines()] if examined_file.path_report is not None else []
    return rows + [f"  {line}".rstrip() for line in examined_file.price_lines]


def _at_which_controls(element_difference: PropertyDifference) -> str:
    """Phrase on the controls at which an actuator's difference has no influence; "" for all other elements."""
    return " at controls of 0, or the nearest in range" if element_difference.owner.startswith("actuator ") else ""


def _comparison_lines(model_comparison: ModelComparison, model_names: Sequence[str]) -> list[str]:
    if model_comparison.acceleration_agreement is None:
        rows = [
            "the files have not the same coordinates:",
            *(f"  {text}" for text in model_comparison.unmatched_coordinates),
        ]
        return rows + [f"  {difference.sentence(model_names)}" for difference in model_comparison.differences]
    agreement, influential = model_comparison.acceleration_agreement, model_comparison.influential
    head = "both files move alike" if model_comparison.alike else "the files do not move alike"
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
        rows.append(f"  {difference.sentence(model_names)} ({size})")
    if not model_comparison.alike:
        rows.append(f"  {model_comparison.remainder_text()}")
    rows += [
        f"  without influence{_at_which_controls(difference)}: {difference.sentence(model_names)}"
        for difference in model_comparison.silent_differences
    ]
    return rows + [
        f"  not compared, since it is off or MuJoCo's alone: {difference.sentence(model_names)}"
        for difference in model_comparison.not_compared
    ]
