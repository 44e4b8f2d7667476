"""What went in this release, and what to use instead; imports nothing."""

# what is typed, an option alone or behind its command -> what to use instead
REPLACED = {
    "--jobs": "split the input, `split -n l/8 ROWS part. && ls part.* | xargs -P 8 -I{} frametool .. -i {} -o {}.out`",
}


def replacement(command: str, word: str) -> str | None:
    """Return the sentence on an option or a subcommand of a command that went; None for any other word."""
    for name in (f"{command} {word}", word):
        if name in REPLACED:
            return f"{name} is gone: {REPLACED[name]}"
    return None
