"""What Python and the system could not do, in words of ours."""

TROUBLES = (MemoryError, ImportError, OSError)


def words_of(trouble: Exception) -> str:
    """Say what Python or the system could not do."""
    if isinstance(trouble, MemoryError):
        return "out of memory"
    if isinstance(trouble, ImportError):  # numpy's tells of missing memory and files in many lines, the cause last
        return f"a library cannot be loaded: {str(trouble).strip().splitlines()[-1]}"
    return (getattr(trouble, "strerror", None) or str(trouble)).lower()
