"""Commands that are called many times in one process: parser and values of options that are not given, made once.

Both come from click itself, so there is no second list of options: the parser is click's own, a value that was given
is processed by its parameter, and one that was not is what click made of an empty line.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import click
from click.core import iter_params_for_processing

if TYPE_CHECKING:
    from collections.abc import Mapping


class Prepared(NamedTuple):
    """What does not change from one call of a command to the next.

    parser: click's, made for all parameters
    direct: the same, in which short names are found at once
    params: all of them
    absent: what the parser says of arguments that are not there
    values, meta: what parameters that are not there leave in a context
    """

    parser: Any
    direct: Any
    params: list[click.Parameter]
    absent: Mapping[str, Any]
    values: Mapping[str, Any]
    meta: Mapping[str, Any]


class Reused(click.Command):
    """A command that is parsed by click at its first call, and with what that left at all others.

    Its parameters must not change, and their callbacks must do no more for an absent value than keep it in the
    context's `meta`, in mappings at most one level deep.
    """

    _calls = 0
    _params: list[click.Parameter] | None = None
    _prepared: Prepared | None = None

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the parameters, collected and checked once."""
        if self._params is None:
            self._params = super().get_params(ctx)
        return self._params

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse as click does; only parameters that stand in the arguments are processed anew."""
        self._calls += 1
        if self._calls == 1 or ctx.resilient_parsing:  # most processes call one command once
            return super().parse_args(ctx, args)
        if self._prepared is None:
            self._prepared = self._prepare(ctx)
        parser, direct, params, absent, values, meta = self._prepared
        if not any(each[2:3] == "=" for each in args):  # -f=x is no -f x
            parser = direct
        parser.ctx = ctx
        given, rest, order = parser.parse_args(args=list(args))
        if rest or not args:
            return super().parse_args(ctx, args)  # has the words for what is wrong
        ctx.meta.update({key: dict(kept) if isinstance(kept, dict) else kept for key, kept in meta.items()})
        wanted = [each for each in params if each.required or _is_given(each.name or "", given, absent)]
        for param in iter_params_for_processing(order, wanted):
            param.handle_parse_result(ctx, given, rest)
        ctx.params = {**values, **ctx.params}
        ctx.args = []
        return []

    def _prepare(self, ctx: click.Context) -> Prepared:
        """Parse no arguments, once, without what may not be missing."""
        params = self.get_params(ctx)
        optional: list[click.Parameter] = [each for each in params if not each.required]
        empty = click.Command(None, params=optional, add_help_option=False).make_context("", [])
        parser, direct = self.make_parser(ctx), self.make_parser(ctx)
        # click looks for -f among the long names first, and fails with all that an error message needs
        direct._long_opt.update(direct._short_opt)  # noqa: SLF001
        return Prepared(parser, direct, params, parser.parse_args(args=[])[0], empty.params, empty.meta)


def _is_given(name: str, given: Mapping[str, Any], absent: Mapping[str, Any]) -> bool:
    """Tell whether the arguments say something of a parameter."""
    return name in given and (name not in absent or given[name] is not absent[name])
