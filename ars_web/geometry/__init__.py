"""Pure geometry: no files, no clock, no globals.

Frames
    `T_world_camera` maps camera coordinates to the world; inner names meet:
    `T_world_box = T_world_camera @ T_camera_box`. A transform is a (4, 4) float64 array, a batch
    `Ts_world_camera` is (n, 4, 4). Metres and radians, right-handed. Camera axes are OpenCV's: x right,
    y down, z forward. Quaternions are `wxyz`, of unit length, w >= 0.

Points
    Points carry their frame in their name: `corners_world`, `centre_camera`, `pixels`. Functions say
    destination from source: `pixels_from_camera_points`.

Boxes
    A virtual box is `T_world_box`, origin at its centre, and `size` (3,) along its own axes, each > 0.

Pixels
    Inside `camera.py` a pixel's centre is at integers (OpenCV's, what `K` means). Everything that leaves
    the geometry for a user, a file or the API is an image coordinate: (0, 0) is the image's top left corner
    and (W, H) its bottom right; `camera.image_from_pixels` and `camera.pixels_from_image` convert, and nothing
    else does. `labels.py` and `mesh_labels.py` return image coordinates.

Labels
    `bbox_amodal` is the whole object's box, unclipped; `bbox` is the box of the part of the object that lies
    in the image. `truncated` is the share of the amodal outline's area outside the image; `visible` the share
    of the in-image outline that no nearer object hides.

Hulls
    A mask is polygons whose rings count by even and odd (`mask_regions`), in image coordinates of the original image.
    The cone of a mask (`viewing_cone`) is open where the mask touches the border of what its camera sees: nothing is
    known about what lies beyond. `visual_hull` intersects cones as closed meshes (`cone_intersection`), and where they
    share nothing, `view_disagreement` says which outlines are at fault and by how many pixels.

Shapes
    A shape of a scene is a box, or a closed mesh that stands in its place. What is seen of shapes behind each other is
    told as shares (`shape_occlusion`; `occlusion` where all are boxes), as masks of pixels (`instance_masks`,
    `run_lengths`) and for points (`hidden_points`). A shape with the camera inside hides nothing.

Speed
    Modules named `*_kernels.py` hold numba's compiled loops over frames and boxes, and nothing else; the module beside
    them says what they are for. Nothing is compiled on import, and what is compiled is kept on disk. Long rows of
    frames go over threads in blocks (`frame_blocks.py`); `numba.set_num_threads` limits them.
"""
