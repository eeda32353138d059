"""The detector trained for a moment: that it learns, the same each time, and that its programs run."""

from pathlib import Path

import orjson
import pytest
import torch

from ars_web.errors import BadFile, BadInput
from examples.train_detector.dataset import read_dataset
from examples.train_detector.network import Detector, load, save
from examples.train_detector.predict import main as predict_program
from examples.train_detector.train import Options, train
from examples.train_detector.train import main as train_program

SMALL = Options(size=(64, 48), iterations=12, batch=4)


def test_the_loss_falls_and_the_same_seed_gives_the_same_weights(exported: Path) -> None:
    dataset = read_dataset(exported / "coco", split="train")
    losses: list[float] = []
    first = train(dataset, SMALL, tell=lambda _, loss: losses.append(loss))
    again = train(dataset, SMALL)
    assert losses[-1] < 0.7 * losses[0]
    assert all(torch.equal(a, b) for a, b in zip(first.state_dict().values(), again.state_dict().values(), strict=True))


def test_weights_come_back_with_their_classes(tmp_path: Path) -> None:
    detector = Detector(2).eval()
    save(detector, tmp_path / "new" / "weights.pt", class_names=("cup", "cube"), size=(64, 48))
    read, class_names, size = load(tmp_path / "new" / "weights.pt")
    assert (class_names, size) == (("cup", "cube"), (64, 48))
    images = torch.zeros(1, 3, 48, 64)
    heat, sides = detector(images)
    assert heat.shape == (1, 2, 12, 16)
    assert sides.shape == (1, 4, 12, 16)
    assert torch.allclose(read(images)[0], heat, atol=1e-5)


@pytest.mark.parametrize("content", [b"", b"no weights"])
def test_a_file_without_weights_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "weights.pt").write_bytes(content)
    with pytest.raises(BadFile, match="holds no weights of this detector"):
        load(tmp_path / "weights.pt")


@pytest.mark.parametrize("options", [{"size": (63, 48)}, {"size": (8, 8)}, {"iterations": 0}, {"batch": 0}])
def test_options_that_cannot_be_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(BadInput, match="must be"):
        Options(**options)


def test_the_programs_of_the_readme_go_from_a_set_to_results(
    exported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    weights, results = str(tmp_path / "weights.pt"), tmp_path / "results.json"
    folder = str(exported / "yolo")
    assert train_program([folder, "--out", weights, "--size", "64x48", "--iterations", "2", "--batch", "2"]) == 0
    assert capsys.readouterr().out.endswith(f"weights   {weights}\n")
    assert predict_program([weights, folder, "--out", str(results)]) == 0
    names = {one.stem for one in (exported / "yolo" / "images" / "val").iterdir()}
    assert {one["image_id"] for one in orjson.loads(results.read_bytes())} <= names
    assert predict_program([weights, folder, "--split", "test", "--out", str(results)]) == 1
    assert "the split test has no images" in capsys.readouterr().err


def test_a_detector_of_other_classes_is_refused(
    exported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(Detector(1), tmp_path / "weights.pt", class_names=("cup",), size=(64, 48))
    line = [str(tmp_path / "weights.pt"), str(exported / "coco"), "--out", str(tmp_path / "results.json")]
    assert predict_program(line) == 1
    assert "finds cup, and" in capsys.readouterr().err
