"""The two errors that volref raises on purpose.

Each message is one sentence: the name of what is wrong, its value, the rule, and the cure.
"""


class SceneError(ValueError):
    """A scene, or a part of it, breaks a rule of the scene model."""


class FormatError(ValueError):
    """A file is not what its format says, or asks for what volref does not read."""
