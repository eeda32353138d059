"""The paper's study in one command: what a detector gains by more images, by views from all round, by tighter labels.

    python -m examples.train_detector.study --out study

It films three scenes with the demo's renderer, outlines and boxes their objects, exports the sets, trains a small
detector on each, and writes `report.html` and `figures.json`. What is done is not done again: killed, the same command
goes on.
"""

import argparse
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ars_web.errors import ArsError, BadInput
from ars_web.sessions.store import SessionStore
from examples.train_detector import scenes
from examples.train_detector.dataset import read_dataset
from examples.train_detector.filming import film
from examples.train_detector.findings import Figures, Run, write_findings
from examples.train_detector.network import save
from examples.train_detector.plan import FULL, QUICK, SCENES, Configuration, Study, frames_of
from examples.train_detector.predict import predict
from examples.train_detector.results import write_results
from examples.train_detector.scores import score
from examples.train_detector.sets import export, make_session, tightness, write_truth
from examples.train_detector.train import Options, train

TURNED = 0.25
"""Radians by which objects are turned between training scenes: little, so that a sector of cameras sees a sector of
every object. In the test scene they are turned anyhow."""


def make_sets(study: Study, out: Path, *, tell: Callable[[str], None]) -> dict[str, float]:
    """The test set and one set a configuration, under `out`; mean IoU of each shape's labels with the true boxes."""

    def progress(done: int, total: int) -> None:
        if done % 50 == 0 or done == total:
            tell(f"  {done} of {total} images")

    tell("Filming the test scene")
    things = scenes.arrange(90, turned=np.pi)
    test = film(
        out / "recordings" / "test",
        things,
        scenes.random_views(study.tested, seed=90),
        size=study.size,
        noise=1_000_000,
        progress=progress,
    )
    write_truth(test, out / "test")
    made = []
    with SessionStore(out / "sessions") as store:
        for number in range(1, SCENES + 1):
            name = f"scene-{number}"
            tell(f"Filming {name}")
            things = scenes.arrange(number, turned=TURNED)
            views = np.concatenate(
                [
                    scenes.even_views(study.around, degrees=360, seed=2 * number),
                    scenes.even_views(study.sector, degrees=180, seed=2 * number + 1),
                ]
            )
            truth = film(
                out / "recordings" / name,
                things,
                views,
                size=study.size,
                noise=10_000 * number,
                progress=progress,
            )
            tell(f"Outlining and boxing the objects of {name}")
            made.append((make_session(store, truth, things, name=name), truth))
    snapshots = [snapshot for snapshot, _ in made]
    for configuration in study.configurations:
        tell(f"Exporting {configuration.name}")
        frames = frames_of(configuration, study)
        export(snapshots, out / "sets" / configuration.name, frames=frames, shape=configuration.shape)
    return {shape: tightness(made, frames=frames_of(study.boxes, study), shape=shape) for shape in ("hull", "box")}


def run(out: Path, configuration: Configuration, seed: int, study: Study) -> Run:
    """Train on one set and score what is found in the test, unless that is done."""
    folder = out / "runs" / f"{configuration.name}-seed-{seed}"
    done = folder / "scores.json"
    if done.exists():
        return Run.read(done)
    begun, worked = time.perf_counter(), time.process_time()
    dataset = read_dataset(out / "sets" / configuration.name, split="train")
    detector = train(dataset, Options(size=study.trained_size, iterations=study.iterations, seed=seed))
    save(detector, folder / "weights.pt", class_names=dataset.class_names, size=study.trained_size)
    test = read_dataset(out / "test", split="test")
    results = predict(detector, test, size=study.trained_size)
    write_results(results, folder / "predictions.json")
    made = Run(
        configuration=configuration,
        seed=seed,
        labels=sum(len(picture.classes) for picture in dataset.pictures),
        scores=score(out / "test", folder / "predictions.json"),
        seconds=time.perf_counter() - begun,
        processor_seconds=time.process_time() - worked,
    )
    made.write(done)
    return made


def run_all(study: Study, out: Path, *, tell: Callable[[str], None]) -> list[Run]:
    """Every training, as many at once as there are cores, each with one thread; seed by seed."""
    wanted = [(configuration, seed) for seed in range(study.seeds) for configuration in study.configurations]
    runs: dict[tuple[Configuration, int], Run] = {}
    workers = min(os.cpu_count() or 1, len(wanted))
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as executor:
        jobs = {executor.submit(run, out, *one, study): one for one in wanted}
        for job in as_completed(jobs):
            configuration, seed = jobs[job]
            runs[configuration, seed] = made = job.result()
            tell(
                f"{configuration.name} seed {seed}: mAP@0.5 {made.scores.ap50:.3f}, @0.75 {made.scores.ap75:.3f},"
                f" @0.5:0.95 {made.scores.ap:.3f} ({made.processor_seconds:.0f} s of processor, {len(runs)} of"
                f" {len(wanted)})"
            )
    return [runs[one] for one in wanted]


def _claim(out: Path, study: Study) -> None:
    """That a folder holds this study and no other."""
    out.mkdir(parents=True, exist_ok=True)
    file, asked = out / "study.json", json.dumps(asdict(study), indent=1)
    if file.exists() and file.read_text() != asked:
        raise BadInput(f"{out}: holds another study than the one that is asked for; name another folder")
    file.write_text(asked)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description="Reproduce the paper's findings on rendered recordings.")
    parser.add_argument("--out", type=Path, required=True, help="the folder that everything is made in")
    parser.add_argument("--quick", action="store_true", help="few images and short trainings: to see it run")
    asked = parser.parse_args(arguments)
    study = QUICK if asked.quick else FULL
    begun = time.perf_counter()

    def tell(line: str) -> None:
        print(f"{time.perf_counter() - begun:6.0f} s  {line}", flush=True)

    try:
        _claim(asked.out, study)
        tight = make_sets(study, asked.out, tell=tell)
        runs = run_all(study, asked.out, tell=tell)
        for file in write_findings(Figures(study, tight, tuple(runs)), asked.out):
            tell(f"written {file}")
    except ArsError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
