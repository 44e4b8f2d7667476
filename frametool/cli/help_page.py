"""The help option of all commands, made without click's translations: those load `locale`, 2 ms of every start."""

from __future__ import annotations

import click

from frametool.cli.sink import writing


def show_help(ctx: click.Context) -> None:
    """Print the help of a command."""
    with writing(None) as write:
        write(f"{ctx.get_help()}\n")


def _help(ctx: click.Context, _: click.Parameter, chosen: bool) -> None:  # click's signature
    if chosen:
        show_help(ctx)
        ctx.exit()


def _has_many_choices(option: click.Option, ctx: click.Context) -> bool:
    """Tell whether the choices of an option are too long to stand beside it."""
    has_choices = isinstance(option.type, click.Choice) and not option.metavar
    return has_choices and len(option.make_metavar(ctx)) > LONGEST_CHOICE


def _spelled(option: click.Option, ctx: click.Context) -> str:
    """Return the names of an option and what it takes."""
    names = ", ".join((*option.opts, *option.secondary_opts))
    if option.is_flag or option.count:
        return names
    taken = option.make_metavar(ctx)
    return f"{names} {option.opts[-1].strip('-').upper() if _has_many_choices(option, ctx) else taken}"


def option_row(option: click.Option, ctx: click.Context) -> tuple[str, str]:
    """Return an option and its meaning, with the choices that its name does not list."""
    text = option.help or ""
    if _has_many_choices(option, ctx):
        what, bracket, default = text.partition("  [")
        text = f"{what}: {', '.join(getattr(option.type, 'choices', ()))}{bracket}{default}"
    if option.show_default and option.default is not None:
        text += f"  [default: {option.default}]"
    return _spelled(option, ctx), text


HELP_OPTION = click.Option(
    ["-h", "--help"], is_flag=True, is_eager=True, expose_value=False, callback=_help, help="Show this message."
)


# heading -> names of the parameters under it; all others stand first, they are what the command is about
GROUPS = {
    "Files": ("more", "with_a", "with_b", "input_forms", "topics", "quiet", "verbose"),
    "Time (help time)": ("at", "times", "source_at", "fixed", "time_column", "moving", "cache", "tf2"),
    "Rotations (help rotations)": ("given", "notations", "deg", "keep_sign", "normalize"),
    "Rows (help streams)": (
        "input_path", "columns", "frame_column", "target_column", "source_column", "keep", "prefix", "header", "unwrap",
        "on_error", "max_errors", "jobs",
    ),
    "Result": ("format_name", "precision", "output", "force", "explain", "explain_full", "explain_step"),
    "What a form of file leaves open (help formats)": (
        "joints", "joint_files", "named_frames", "direction", "camera_axes", "dh", "stamps", "edges", "array",
    ),
}  # fmt: skip
NAMES_ONLY = tuple(GROUPS)[-1]  # explained by the topic alone
WIDEST = 24  # of the left column
LONGEST_CHOICE = 14  # of choices beside their option


class WithHelp(click.Command):
    """A command with -h and --help, its options in groups."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options group by group, those of this command first; then the commands of a group."""
        self._format_groups(ctx, formatter)
        if isinstance(self, click.Group):
            self.format_commands(ctx, formatter)

    def _format_groups(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = [each for each in self.get_params(ctx) if isinstance(each, click.Option) and not each.hidden]
        placed = {name: title for title, names in GROUPS.items() for name in names}
        shown = [each for each in options if placed.get(each.name or "") != NAMES_ONLY]
        width = max((size for each in shown if (size := len(_spelled(each, ctx))) <= WIDEST), default=0)
        formatter.write_paragraph()
        for title in ("Options", *GROUPS):
            ours = [each for each in options if placed.get(each.name or "", "Options") == title]
            if not ours:
                continue
            formatter.write(f"{title}:\n")
            with formatter.indentation():
                if title == NAMES_ONLY:
                    formatter.write_text("  ".join(each.opts[-1] for each in ours))
                else:
                    rows = [option_row(each, ctx) for each in ours]
                    formatter.write_dl([(left.ljust(width), text) for left, text in rows], WIDEST, col_spacing=1)

    def get_help_option(self, ctx: click.Context) -> click.Option | None:  # noqa: ARG002 - click's signature
        """Return the one help option."""
        return HELP_OPTION
