"""How good detections are: true and predicted rectangles read, matched and scored."""
