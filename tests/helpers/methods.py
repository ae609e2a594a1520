"""The dynamics methods that every tree is put to: those of the table."""

import linkwise as lw

# Conjugate gradients in joint space lose digits with the number of joints and are tested on their
# own; methods for one kind of machine likewise.
METHODS = [
    entry["name"]
    for entry in lw.methods()
    if not entry["chains_only"] and entry["name"] != "joint_space_conjugate_gradient"
]
