"""ARS Web turns a tracked camera recording into a labelled training set."""

__version__ = "0.1.0"
