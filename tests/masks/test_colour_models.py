"""Colours learnt from one photograph cut another."""

import numpy as np

from ars_web.masks.colour_models import ColourModels


def noisy(colour: tuple[int, int, int], n: int, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 6, (n, 3))
    return (np.array(colour) + noise).clip(0, 255).astype(np.uint8)


RED, BLUE, GREY = (120, 180, 160), (130, 130, 80), (160, 128, 128)


def picture() -> tuple[np.ndarray, np.ndarray]:
    """A red square on blue and grey, and where it is."""
    lab = noisy(BLUE, 80 * 80, 1).reshape(80, 80, 3)
    lab[:, 50:] = noisy(GREY, 80 * 30, 2).reshape(80, 30, 3)
    truth = np.zeros((80, 80), dtype=np.bool_)
    truth[20:60, 25:65] = True
    lab[truth] = noisy(RED, int(truth.sum()), 3)
    return lab, truth


def learnt() -> ColourModels:
    return ColourModels.learnt(noisy(RED, 3000, 4), np.concatenate([noisy(BLUE, 2000, 5), noisy(GREY, 2000, 6)]))


def test_what_was_learnt_elsewhere_cuts_the_object_out():
    lab, truth = picture()
    found = learnt().cut(lab, np.ones_like(truth))
    assert (found & truth).sum() / (found | truth).sum() > 0.98


def test_nothing_is_found_where_it_is_impossible():
    lab, truth = picture()
    possible = np.zeros_like(truth)
    possible[:, :40] = True
    found = learnt().cut(lab, possible)
    assert not (found & ~possible).any()
    np.testing.assert_array_equal(found[:, :39], truth[:, :39])


def test_cutting_leaves_the_models_as_they_are_and_is_the_same_again():
    lab, truth = picture()
    models = learnt()
    background, foreground = models.background.copy(), models.foreground.copy()
    first = models.cut(lab, np.ones_like(truth))
    np.testing.assert_array_equal(models.background, background)
    np.testing.assert_array_equal(models.foreground, foreground)
    np.testing.assert_array_equal(learnt().cut(lab, np.ones_like(truth)), first)


def test_few_pixels_are_enough():
    lab, truth = picture()
    models = ColourModels.learnt(noisy(RED, 7, 4), noisy(BLUE, 5, 5))
    assert models.cut(lab, truth).any()
