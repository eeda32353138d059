"""The HTTP door: one router a resource. A handler parses, calls one function of a layer below, shapes the answer."""
