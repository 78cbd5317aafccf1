"""A study carried out: its runs, results and report, in a folder."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import typer
import xarray as xr

import flexband as fb
from flexband.cli.answers.older import OF_RUN, altered, mark_older, stale
from flexband.cli.course import Course
from flexband.cli.files import check_folder, save
from flexband.cli.messages import (
    DOUBTFUL,
    WAITING,
    in_words,
    print_json,
    print_remark,
    print_table,
    print_text,
)
from flexband.cli.plan import Plan
from flexband.cli.report import GIVEN, PAGE, SHARES, report_on
from flexband.errors import RunsNeeded, ToleranceWarning, without_warnings
from flexband.execution.fingerprint import fingerprint
from flexband.execution.growing import GrowingArrays
from flexband.execution.lock import this_process
from flexband.execution.store import Store
from flexband.progress import doing, hearing
from flexband.report.numbers import percent
from flexband.report.progress import progress_bars
from flexband.study.compiling import compile_ahead
from flexband.study.folder import StudyFolder, checksum_of
from flexband.study.identity import identity
from flexband.study.points import Points
from flexband.study.study import Study
from flexband.uncertainty.evaluations.evaluations import evaluations
from flexband.uncertainty.evaluations.reuse import located
from flexband.uncertainty.inputs.choices import cases
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.runs.memory import peak_memory
from flexband.uncertainty.surrogates.verdicts import implied_error
from flexband.words import are, number_of

LARGE = 0.25
"""An error that new runs find, in parts of the error bar's width, above which a result is
doubtful, unless its tolerance is larger."""

MOST = 10.0
"""Larger errors are not told, since the error bar has no width."""


def carry_out(
    plan: Plan,
    output: Path,
    *,
    recorded: bool = True,
    insist: bool = False,
    replace: bool = False,
    again: bool = False,
    as_json: bool = False,
) -> None:
    """Run a study; write and print its results.

    Parameters
    ----------
    recorded : whether runs are recorded in the folder, and those that are there used.
    insist : whether to use runs there that may come from another response.
    replace : whether runs there are deleted before.
    again : whether runs there that failed are made again.
    as_json : whether results are printed as JSON.
    """
    study = plan.study()
    check_folder(output)
    folder = StudyFolder(output)
    with folder.held(kept=recorded):
        if replace and folder.recorded:
            print_text(f"The runs in {folder.runs} are deleted.", error=True)
            folder.delete_runs()
        own = plan.file, fingerprint(study.response)
        if not insist and folder.has_only_failures_of_others(own[1]):
            folder.delete_runs()
        folder.check_claim(*own, replace=replace, insist=insist)
        claim = partial(save, partial(folder.claim, *own))
        store = Store(output, insist=insist) if recorded else None
        own = identity(study, plan.new_runs(study), plan.policy) if recorded else ""
        if again and store is not None:
            forget_failed(study, store)
        elif recorded and (result := finished(folder, own)):
            if not as_json:
                print_table(result["title"], result["table"])
            tell(result, as_json=as_json)
            print_text(f"{output} has this result already: no run was made.", error=True)
            raise typer.Exit(DOUBTFUL if result["doubts"] else 0)
        about = {
            **plan.told(),
            "command": shlex.join(["flexband", *sys.argv[1:]]),
            "identity": own,
            "process": this_process(),
            "started": time.strftime("%Y-%m-%d %H:%M:%S%z"),
        }
        course = Course(folder, about, claim, partial(memory_of, study, store))
        if not recorded:
            claim()
        course.begins(recorded=recorded)
        try:
            with hearing(course.hear):
                result = results(plan, study, store, course, as_json=as_json)
        except BaseException as error:
            if isinstance(error, RunsNeeded) and store is not None:
                wait(course, error, study)
            course.ends(error, recorded=recorded)
            raise
        if store is not None:
            course.write("finished", result=result)
    tell(result, as_json=as_json)
    if result["doubts"]:
        raise typer.Exit(DOUBTFUL)


def memory_of(study: Study, store: Store | None, runs: int, one: float) -> tuple[float, float]:
    """Return what `peak_memory` does; the combinations of options are studied one by one."""
    inputs = cases(located(study.response, study.inputs, store)[0])
    intervals = Space(next(iter(inputs.values()))).interval_dimension
    return peak_memory(study.method, intervals, -(-runs // len(inputs)), one)


def wait(course: Course, needed: RunsNeeded, study: Study) -> NoReturn:
    """Write the points that are to be run elsewhere, tell so and exit."""
    folder, count = course.folder.path, len(needed.points)
    if any(isinstance(one, fb.RandomField) for one in study.inputs.values()):
        raise fb.InputError("a response elsewhere takes numbers and texts; got a RandomField")
    file = Points.of(folder).ask(needed, study.inputs)
    course.write("waiting", points={"count": count, "file": str(file)})
    print_text(f"{are(count, 'point')} to be run: {file}")
    print_text(f"`flexband ingest {folder} RESULTS.csv` records their results")
    raise typer.Exit(WAITING)


def finished(folder: StudyFolder, own: str) -> dict[str, Any] | None:
    """Return the result in the folder if it is that of the same study, and its files are there."""
    try:
        about = folder.read()
    except fb.StoreError as error:
        print_remark(str(error))
        return None
    result = about.get("result")
    if about.get("identity") != own or about.get("state") != "finished":
        return None
    page = folder.path / PAGE  # which answers may have been added to
    there = page.is_file() and folder.is_result(result)
    return result if there and are_intact(folder.path) else None


def are_intact(folder: Path) -> bool:
    """Return whether what `flexband run` writes for the report, and commands may change, is there.

    Whether it is as written is told by each file.
    """
    from flexband.report.page.given import read_given  # noqa: PLC0415
    from flexband.report.results import read_netcdf  # noqa: PLC0415

    try:
        if SHARES in read_given(folder)["files"]:
            read_netcdf(folder / SHARES)
    except (fb.InputError, OSError, KeyError):
        return False
    return not altered(folder, OF_RUN)


def forget_failed(study: Study, store: Store) -> None:
    """Let the failed runs of a store be made again, and tell how many."""
    inputs = located(study.response, study.inputs, store)[0]
    with evaluations(study.response, inputs, store=store) as evaluate:
        assert evaluate.record is not None
        count = evaluate.record.forget_failed()
    print_text(f"{are(count, 'failed run')} made again if needed.", error=True)


def results(
    plan: Plan, study: Study, store: Store | None, course: Course, *, as_json: bool
) -> dict[str, Any]:
    """Make the runs, print the table, write data and report; return what is told of them."""
    from flexband.report import tables  # noqa: PLC0415
    from flexband.report.results import write_netcdf  # noqa: PLC0415

    output, label, where = course.folder.path, study.method.label, plan.where()
    data, model, checks = (output / f for f in ("bands.nc", "surrogate.npz", "verification.nc"))
    known = model.is_file() and not model.is_symlink()
    earlier = course.folder.signed([model]) if known else {}
    options = {"batch": plan.batch, "store": store, "executor": where, "failed": plan.policy}
    doing("compiling what is not compiled yet")
    compile_ahead(study)
    if store is not None and (before := recorded_runs(course.folder)):
        there = f"{output} has {number_of(before, 'recorded run')}"
        print_text(f"{there}; those that serve are not made again.", error=True)
    surrogate, files, bands = made(study, model, course, options)
    changed = model not in files or course.folder.signed([model]) != earlier
    if changed:  # before anything may end this process
        mark_older(output)
    if changed and model in files:
        forget_page(output)
    if save(lambda: write_netcdf(bands, data)):
        files.append(data)
        forget_page(output)
    checked, new = None, plan.new_runs(study)
    if surrogate is not None and new:
        own = {k: options[k] for k in ("store", "executor", "failed")}
        checked = verified(surrogate, study, course, runs=new, **own)
    if checked is not None:
        files += [checks] * save(lambda: write_netcdf(checked, checks))
    title = f"{plan.title}: {label}, {number_of(bands.attrs['runs'], 'run')}"
    table = tables.summary_table(bands, checked)
    if not as_json:
        print_table(title, table)
    if surrogate is None:
        inputs = study.inputs
    else:
        inputs = surrogate.space.given if isinstance(surrogate, fb.Surrogate) else surrogate.given
    fields = {k: i for k, i in inputs.items() if isinstance(i, fb.Field) and i.domain is not None}
    why = doubts(bands, checked, asked=bool(new))
    about = {
        "title": plan.title,
        "label": label,
        "file": plan.file,
        "computed": computed(course.about),
        "seconds": (time.monotonic() - course.begin) / (int(bands.attrs["runs"]) + new),
        "doubts": why,
        "files": [file.name for file in files],
        "remarks": [*tables.remarks(bands, checked, why), *tables.field_remarks(fields)],
    }
    doing("the report")
    page, answer = reported(study, output, bands, surrogate, checked, inputs, about)
    kinds = {model: "Model: ", data: "Data:  ", checks: "Check: "}
    written = [f"Report: {page}"] * bool(page) + [f"{kinds[own]} {own}" for own in files]
    shares, drawn = output / SHARES, output / "contributions.png"
    older = [own for own in (model, checks) if own.exists() and own not in files]
    older += [shares] * (surrogate is None and shares.exists())
    older += [drawn] * (changed and drawn.exists()) + stale(output)
    written += [f"Older:  {own}, of an earlier run" for own in older]
    result = {
        "title": title,
        "table": table,
        "answer": answer,
        "runs": int(bands.attrs["runs"]),
        "doubts": about["doubts"],
        "remarks": about["remarks"],
        "written": written,
        "checksums": course.folder.signed(files),
    }
    return {**result, "checksum": checksum_of(result)}


def forget_page(output: Path) -> None:
    """Delete a report of other bands, and what is known of it."""
    for name in (GIVEN, PAGE):
        (output / name).unlink(missing_ok=True)


def made(
    study: Study, model: Path, course: Course, options: dict[str, Any]
) -> tuple[Any, list[Path], xr.Dataset]:
    """Make the runs; return the surrogate, None without one, the file it is in, and the bands."""
    doing("runs")
    with progress_bars() as task:
        bar = task(study.method.label)
        progress = bar if options["store"] is None else course.of(bar)
        if not study.expands:
            return None, [], study.run(**options, progress=progress)
        with without_warnings(ToleranceWarning):  # which is one of the doubts
            surrogate = study.expand(**options, progress=progress)
        files = [model] * save(lambda: fb.save_surrogate(surrogate, model))
        doing("the bands of the expansion")
        return surrogate, files, surrogate.bands(study.sigmas)


def reported(study: Study, *results: Any) -> tuple[Path | None, list[str]]:
    """Return what `report_on` does; if it fails, though not for lack of space, print a remark."""
    try:
        return report_on(study, *results)
    except OSError:
        raise
    except Exception as error:  # the results are there
        print_remark(f"the report is not written: {in_words(error)}")
        return None, []


def computed(about: Mapping[str, Any]) -> dict[str, str]:
    """Return by what a study was computed, and when, by name."""
    return {"command": about["command"], "file": about["file"], "date": about["started"][:16]}


def recorded_runs(folder: StudyFolder) -> int:
    """Return the number of runs in the arrays of a folder."""
    return GrowingArrays(folder.runs).runs


def verified(surrogate: Any, study: Study, course: Course, **options: Any) -> xr.Dataset | None:
    """Return how new runs judge a surrogate; print a remark and return None if they fail."""
    doing("new runs that verify the result")
    try:
        with progress_bars() as task:
            bar = task("new runs")
            options["progress"] = bar if options["store"] is None else course.of(bar)
            return fb.verify(surrogate, study.response, sigmas=study.sigmas, **options)
    except RunsNeeded:
        raise
    except Exception as error:  # whatever a response raises; the bands are there
        print_remark(f"the result is not verified: {in_words(error)}")
        return None


def doubts(bands: xr.Dataset, checked: xr.Dataset | None, *, asked: bool) -> list[str]:
    """Return why a result is not what was asked for; `asked` is whether new runs were."""
    own, found = bands.attrs, []
    if own.get("expected_error", 0.0) > own.get("tolerance", float("inf")):
        found.append("the tolerance is not met")
    if "not_trusted" in own:
        found.append("the result is not trusted")
    if checked is not None and checked.attrs["confirmed"] == "no":
        found.append("new runs do not confirm the result")
    elif checked is not None and (far := implied_error(checked)) > max(
        LARGE, own.get("tolerance", 0.0)
    ):
        found.append(
            f"new runs find an error of {'more than ' * (far > MOST)}{percent(min(far, MOST))} of "
            "the error bar's width"
        )
    if checked is None and asked:
        found.append("new runs failed, so that the result is not verified")
    return found


def tell(result: dict[str, Any], *, as_json: bool) -> None:
    """Print a result, whose table has been printed."""
    if as_json:
        print_json(
            {k: v for k, v in result.items() if k not in ("checksum", "checksums", "written")}
        )
    else:
        answer = result["answer"]
        details = [line for line in result["remarks"] if f"{line}." not in answer]
        print_text("\n".join([*answer, "", *details, "", *result["written"]]))
