"""Why some faults are caught on no chart, or told from another one on none: by "key", or "key other"."""

REASONS: dict[str, str] = {}
