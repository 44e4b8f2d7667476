"""Output for people: aligned text, charts, pictures and pages; the only package that imports rich."""
