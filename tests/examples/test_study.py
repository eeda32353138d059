"""The study's parts on a small scene: what is filmed and from where, the sets made of it, what is reported."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import orjson
import pytest

from ars_web.demo import building, scene
from ars_web.demo.truth import DemoTruth
from ars_web.sessions.store import SessionStore
from examples.train_detector import plan, scenes, sets
from examples.train_detector.dataset import read_dataset
from examples.train_detector.filming import film, outlines
from examples.train_detector.findings import Figures, Run, findings, write_findings
from examples.train_detector.plan import Configuration, frames_of
from examples.train_detector.results import Result, write_results
from examples.train_detector.scores import Scores, score

SIZE = (128, 96)
AROUND = 24


@pytest.fixture(scope="module")
def things():
    return scenes.arrange(1, turned=0.2)


@pytest.fixture(scope="module")
def filmed(things, tmp_path_factory: pytest.TempPathFactory) -> DemoTruth:
    """A scene from all round, in the dark: what light falls on it is of no matter here, and takes long."""
    folder = tmp_path_factory.mktemp("filmed")
    with ThreadPoolExecutor(2) as executor:
        world = building.build_world(things, desk=scene.desk(), executor=executor)
    views = scenes.even_views(AROUND, degrees=360, seed=1)
    return film(folder / "scene", things, views, size=SIZE, noise=0, world=world)


@pytest.mark.parametrize("seed", range(5))
def test_no_object_reaches_into_another(seed: int) -> None:
    things = scenes.arrange(seed, turned=np.pi)
    assert sorted(thing.class_name for thing in things) == sorted(scenes.NAMES)
    centres = np.array([thing.box.T_world_box[:2, 3] for thing in things])
    reach = np.array([np.hypot(*sorted(thing.box.size)[1:]) / 2 for thing in things])
    for i in range(len(things)):
        for j in range(i):
            assert np.linalg.norm(centres[i] - centres[j]) > reach[i] + reach[j]


def test_a_sector_is_half_and_any_first_views_are_spread_over_all_of_it() -> None:
    for degrees in (180, 360):
        eyes = scenes.even_views(400, degrees=degrees, seed=3)[:, :3, 3]
        azimuths = np.degrees(np.arctan2(eyes[:, 1], eyes[:, 0]))
        assert np.abs(azimuths).max() < degrees / 2 + 15  # the place looked at is up to 0.14 m off the middle
        for first in (20, 100, 400):
            counts = np.histogram(azimuths[:first], bins=6, range=(-degrees / 2, degrees / 2))[0]
            assert counts.min() >= first / 6 * 0.6


def test_what_is_filmed_is_not_filmed_again(filmed: DemoTruth, things) -> None:
    before = {path: path.stat().st_mtime_ns for path in filmed.folder.rglob("*")}
    film(filmed.folder, things, filmed.Ts_world_camera, size=SIZE, noise=0)
    assert {path: path.stat().st_mtime_ns for path in filmed.folder.rglob("*")} == before


def test_outlines_are_of_frames_that_show_the_object_whole(filmed: DemoTruth, things) -> None:
    drawn = outlines(filmed, things, 0, count=6)
    assert len(drawn) == 6
    for frame, polygons in drawn:
        ring = polygons[0].outer
        found = np.concatenate([ring.min(axis=0), ring.max(axis=0)])
        assert found == pytest.approx(filmed.bbox_amodal[frame, 0], abs=1.0)


def test_sets_hold_the_frames_and_shapes_that_were_asked_for(filmed: DemoTruth, things, tmp_path: Path) -> None:
    with SessionStore(tmp_path / "sessions") as store:
        made = sets.make_session(store, filmed, things, name="scene")
        again = sets.make_session(store, filmed, things, name="scene")
    assert (again.id, again.state.revision) == (made.id, made.state.revision)
    assert all(box.has_hull for box in made.state.boxes.values())
    for shape in ("hull", "box"):
        sets.export([made], tmp_path / shape, frames=range(3, 13), shape=shape)
        told = orjson.loads((tmp_path / shape / "dataset.json").read_bytes())
        assert told["splits"]["train"]["images"] == 10
        assert told["options"]["shape"] == shape
        assert read_dataset(tmp_path / shape, split="train").class_names == filmed.class_names
    tight = {shape: sets.tightness([(made, filmed)], frames=range(10), shape=shape) for shape in ("hull", "box")}
    assert tight["hull"] > 0.85
    assert tight["hull"] > tight["box"] + 0.1


def test_the_truth_itself_scores_full(filmed: DemoTruth, tmp_path: Path) -> None:
    sets.write_truth(filmed, tmp_path / "test")
    read = read_dataset(tmp_path / "test", split="test")
    results = [
        Result(image_id=picture.id, category_id=read.categories[class_], bbox=_bbox(box), score=0.9)
        for picture in read.pictures
        for box, class_ in zip(picture.boxes * (SIZE * 2), picture.classes, strict=True)
    ]
    write_results(results, tmp_path / "all.json")
    whole = score(tmp_path / "test", tmp_path / "all.json")
    assert (whole.ap50, whole.ap75, whole.ap) == pytest.approx((1, 1, 1))
    assert whole.ap50_of_class == pytest.approx(dict.fromkeys(filmed.class_names, 1))
    assert len(whole.precision50) == 101
    write_results(results[::2], tmp_path / "half.json")
    assert score(tmp_path / "test", tmp_path / "half.json").ap50 < 0.75


def _bbox(box: np.ndarray) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = box.tolist()
    return x0, y0, x1 - x0, y1 - y0


@pytest.mark.parametrize("study", [plan.FULL, plan.QUICK], ids=lambda study: study.name)
def test_every_set_is_made_of_frames_that_are_filmed(study: plan.Study) -> None:
    for configuration in study.configurations:
        frames = frames_of(configuration, study)
        assert len(frames) * plan.SCENES == configuration.images
        first, end = (0, study.around) if configuration.degrees == 360 else (study.around, study.around + study.sector)
        assert first <= frames.start < frames.stop <= end


def _figures(ap_of: dict[Configuration, tuple[float, float]]) -> Figures:
    study = replace(plan.FULL, seeds=2)
    runs = [
        Run(one, seed, 10, Scores(0.9, ap, ap, {"tea": 0.9}, tuple(np.linspace(1, 0, 101).tolist())), 2.0, 1.0)
        for seed in range(2)
        for one in study.configurations
        for ap in [ap_of[one][seed]]
    ]
    return Figures(study, {"hull": 0.94, "box": 0.71}, tuple(runs))


def _aps(**others: tuple[float, float]) -> dict[Configuration, tuple[float, float]]:
    study = plan.FULL
    aps = {one: (0.1 * place, 0.1 * place + 0.02) for place, one in enumerate(study.more, start=1)}
    few = aps[study.fewer_around]
    return aps | {study.more_in_sector: others.get("sector", few), study.boxes: others.get("boxes", few)}


def test_findings_hold_hold_on_average_or_do_not() -> None:
    assert [one.holds for one in findings(_figures(_aps(sector=(0.1, 0.2), boxes=(0.2, 0.31))))] == [
        "holds",
        "holds",
        "holds on average",
    ]
    assert [one.holds for one in findings(_figures(_aps(sector=(0.5, 0.6), boxes=(0.3, 0.33))))][1:] == [
        "does not hold",
        "does not hold",
    ]


def test_a_run_comes_back_from_its_file(tmp_path: Path) -> None:
    run = _figures(_aps()).runs[0]
    run.write(tmp_path / "scores.json")
    assert Run.read(tmp_path / "scores.json") == run


def test_the_report_holds_every_figure(filmed: DemoTruth, tmp_path: Path) -> None:
    for name in ("scene-1", "scene-2", "test"):
        images = tmp_path / "recordings" / name / "images"
        images.mkdir(parents=True)
        for i in (0, 1, 3, plan.FULL.around):
            (images / f"{i:05d}.jpg").hardlink_to(filmed.folder / "images" / filmed.image_names[0])
    figures = _figures(_aps())
    written = write_findings(figures, tmp_path)
    assert [file.name for file in written] == ["figures.json", "findings.png", "report.html"]
    page = written[2].read_text()
    assert "0.310 (0.300 to 0.320)" in page
    assert "does not hold" in page
    assert page.count("data:image/png") == 3
    told = orjson.loads(written[0].read_bytes())
    assert len(told["runs"]) == len(figures.runs)
