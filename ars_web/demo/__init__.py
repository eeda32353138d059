"""A generated table-top recording whose truth is known: what `make demo` opens and what the tests stand on.

`truth.py`      what is known of a recording, and reading it back
`recording.py`  writing the recording to disk, once
`scene.py`      what lies on the desk and where the camera goes
`pictures.py`   what is printed on things
`shapes.py`     rays against shapes, in numba
`shading.py`    light baked on surfaces, and the colour of a point, in numba
`rendering.py`  frames and their truth, pixel by pixel, in numba
"""
