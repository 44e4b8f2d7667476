"""Output for people: aligned text, charts, pictures and pages; the only room that imports rich."""
