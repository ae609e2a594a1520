"""Where the two links of each loop joint have its frame: from the links' poses alone."""

import numpy as np

import linkwise as lw


def closing_frames(model, q):
    """Poses (n_loops, 2, 4, 4) in the world of each loop joint's frame on its two links."""
    links = dict(zip(model.link_names, lw.link_poses(model, q), strict=True))
    ends = zip(model.loop_parent_link_names, model.loop_child_link_names, strict=True)
    placed = [
        [links[parent] @ place[0], links[child] @ place[1]]
        for (parent, child), place in zip(ends, model.loop_placements, strict=True)
    ]
    return np.array(placed).reshape(-1, 2, 4, 4)
