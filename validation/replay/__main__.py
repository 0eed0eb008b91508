"""``python -m validation.replay``: record the outputs of the command line, or check a later version against them."""

import argparse
import fnmatch
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from validation.replay import jobs as asked
from validation.replay.answers import (
    JOBS_FILE,
    CommandOutput,
    load_output,
    output_difference,
    output_of_job,
    read_jobs,
    save_output,
    write_jobs,
)


def main(command_words: list[str]) -> int:
    """Record or check the outputs of all jobs; returns the exit code, which is 1 if a value, an exit code or a channel
    differs from the recording."""
    parser = argparse.ArgumentParser(prog="python -m validation.replay", description=__doc__)
    parser.add_argument("what", choices=("record", "check"))
    parser.add_argument("folder", type=Path, help="of the recording; one that was begun is gone on with")
    parser.add_argument("--command", default=str(Path(sys.executable).with_name("twinrig")), help="the twinrig to ask")
    parser.add_argument("--only", default="*", help="names of jobs, as in `wheelset*`")
    parser.add_argument("--every", type=int, default=1, help="only each so manieth job")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--bound", type=float, default=0.0, help="allowed change, by a channel's largest number")
    parser.add_argument("--renamed", type=Path, help="TOML of earlier names of channels and later ones")
    arguments = parser.parse_args(command_words)
    if arguments.what == "record":
        return _record_outputs(arguments)
    return _check_outputs(arguments)


def _record_outputs(command_arguments: argparse.Namespace) -> int:
    command_arguments.folder.mkdir(parents=True, exist_ok=True)
    if not (command_arguments.folder / JOBS_FILE).exists():
        write_jobs(command_arguments.folder, asked.replay_jobs(command_arguments.command))
    left = [job for job in _selected_jobs(command_arguments) if load_output(command_arguments.folder, job.name) is None]
    for job, current_answer in _outputs_of_jobs(left, command_arguments):
        save_output(command_arguments.folder, job.name, current_answer)
        codes = ", ".join(map(str, current_answer.codes))
        print(
            f"{current_answer.seconds:7.1f} s  {len(current_answer.arrays):4} arrays  {job.name}: {codes}", flush=True
        )
    return 0


def _check_outputs(command_arguments: argparse.Namespace) -> int:
    renamed = tomllib.loads(command_arguments.renamed.read_text()) if command_arguments.renamed else {}
    counts = {"same": 0, "differ": 0, "other words": 0}
    for job, current_answer in _outputs_of_jobs(_selected_jobs(command_arguments), command_arguments):
        recorded_answer = load_output(command_arguments.folder, job.name)
        if recorded_answer is None:
            print(f"{job.name}: was not recorded")
            continue
        difference = output_difference(recorded_answer, current_answer, command_arguments.bound, renamed)
        counts["differ" if difference.wrong else "other words" if difference.tolerated else "same"] += 1
        for text in (difference.wrong or difference.tolerated)[:5]:
            print(f"{job.name}: {'DIFFERS: ' if difference.wrong else ''}{text}", flush=True)
    print(", ".join(f"{count} {outcome}" for outcome, count in counts.items()))
    return 1 if counts["differ"] else 0


def _selected_jobs(command_arguments: argparse.Namespace) -> list[asked.ReplayJob]:
    return [
        job
        for job in read_jobs(command_arguments.folder)[:: command_arguments.every]
        if fnmatch.fnmatch(job.name, command_arguments.only)
    ]


def _outputs_of_jobs(
    selected_jobs: list[asked.ReplayJob], command_arguments: argparse.Namespace
) -> Iterator[tuple[asked.ReplayJob, CommandOutput]]:
    """Yield each job with the outputs of its commands, in the order of the jobs; several jobs run at a time."""
    folder = Path(tempfile.mkdtemp(prefix="replay-"))

    try:
        with ThreadPoolExecutor(command_arguments.workers) as pool:
            yield from zip(
                selected_jobs,
                pool.map(lambda job: output_of_job(job, command_arguments.command, folder / job.name), selected_jobs),
                strict=True,
            )
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
