"""How good detections are: true and predicted rectangles read, matched and scored.

    truth = truth_reading.read_truth(Path("dataset"), split="val")
    found = prediction_reading.read_predictions(Path("results.json"), truth)
    evaluation = scoring.evaluate(truth, [found], iou=0.5)
    evaluation.detectors[0].averages.at_50

A training loop needs no files: `Truth` and `Predictions` (`detections.py`) are columns that it fills itself, and
`Evaluation` (`scores.py`) is what comes back. Rectangles are x0, y0, x1, y1 in image coordinates.

Three rules of matching, each as its source has it, and none mixed with another:

- COCO's (all that is not called VOC's): within an image and a class, in order of score, each of the best 100
  predictions takes the free label that it overlaps most, by the threshold at least. AP is the mean precision at 101
  recalls.
- VOC's: each prediction has the label that it overlaps most, free or not; the first in order of score finds it, the
  others are wrong. AP is the area under the curve (since 2010), or the mean precision at 11 recalls (2007), which is
  what papers of the time mean by mAP at 0.5.
- COCO's own numbers by pycocotools (`coco_numbers.py`), sizes and recalls among them.

Labels that count for nothing (COCO's crowds, VOC's `difficult`) are ignored: whoever finds one is neither right nor
wrong.
"""
