"""What couldn't be translated: once in the console, and kept for the panel."""

_warnings = []


def clear():
    _warnings.clear()


def warn(text):
    if text not in _warnings:
        _warnings.append(text)
        print("Nacre: " + text)


def warnings():
    return list(_warnings)
