"""The 3-D view of a model or a run in the browser, and as a file that plays offline.

`source` says what is shown, `shapes` and `arrows` turn it into meshes and instances (NumPy alone),
`playback` keeps the time; `scene`, `panel` and `load_plot` put them into viser, `live` and `export`
run it.
"""
