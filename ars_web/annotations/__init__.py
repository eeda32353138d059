"""Labels of other programs, read as they are: posed objects, outlines and rectangles, by image. No sessions in here."""
