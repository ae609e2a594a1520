"""Files that may be anything: they load, or are refused with one line that names them."""

import linkwise as lw


def load_or_complain(folder, name, data):
    """Write the bytes `data` as `folder / name` and load it."""
    path = folder / name
    path.write_bytes(data)
    try:
        lw.load(path)
    except lw.InputError as error:
        message = str(error)
    else:
        return
    assert message.isprintable()
    assert name in message
    assert "; " in message
