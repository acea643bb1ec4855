"""What the programs may say: finds calls in their syntax trees, and the texts that an argument of a call may have.

Where a text is a variable, these are all values that the code may give it: assignments to it, or arguments from the
function's callers. A value quoted in a text appears as a word in capitals.
"""

import ast
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_EXITS: Final = {"SettingsError": 2, "UnavailableError": 3, "DataError": 4}
"""Error classes that a user meets, with their exit codes; subclasses are found in the code."""


@dataclass(frozen=True, slots=True)
class Place:
    """A call that makes an error or a concern, with its function and file."""

    path: Path
    call: ast.Call
    around: ast.FunctionDef | None


_NOWHERE: Final = ast.Call(ast.Name("nowhere"), [], [], lineno=sys.maxsize)
"""Placeholder for a call, for use where every assignment in a function counts."""


class Code:
    """The syntax trees of the packages, and queries on them."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in paths}
        self._functions: dict[str, list[ast.FunctionDef]] = {}
        self._calls: dict[str, list[Place]] = {}
        self._constants: dict[Path, dict[str, ast.expr]] = {}
        for path, tree in self.trees.items():
            self._constants[path] = dict(_assigned(tree.body))
            self._visit(path, tree, None)
        self.errors = self._subclasses()

    def _visit(self, path: Path, node: ast.AST, around: ast.FunctionDef | None) -> None:
        for child in ast.iter_child_nodes(node):
            inner = around
            if isinstance(child, ast.FunctionDef):
                inner = child
                self._functions.setdefault(child.name, []).append(child)
            elif isinstance(child, ast.Call) and (name := called(child)):
                self._calls.setdefault(name, []).append(Place(path, child, around))
            self._visit(path, child, inner)

    def _subclasses(self) -> dict[str, int]:
        errors = dict(_EXITS)
        classes = [node for tree in self.trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
        for _ in range(3):
            for found in classes:
                for base in found.bases:
                    if isinstance(base, ast.Name) and base.id in errors:
                        errors.setdefault(found.name, errors[base.id])
        return errors

    def calls(self, names: Iterator[str] | Sequence[str]) -> list[Place]:
        """Every call of these names, by file and line."""
        found = [place for name in names for place in self._calls.get(name, [])]
        return sorted(found, key=lambda place: (str(place.path), place.call.lineno))

    def returned(self, function: str) -> list[tuple[ast.expr, ast.expr]]:
        """Pairs of problem and remedy that a function returns."""
        nodes = [node for found in self._functions.get(function, []) for node in ast.walk(found)]
        pairs = [
            node.value.elts for node in nodes if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple)
        ]
        return [(pair[0], pair[1]) for pair in pairs if len(pair) == 2]

    def texts(self, place: Place, expression: ast.expr, depth: int = 4) -> list[str]:  # noqa: PLR0911 - one line for each kind of expression
        """All texts that an expression may have, with values as words in capitals; none if they cannot be determined."""
        match expression:
            case ast.Constant(value=str() as text):
                return [text]
            case ast.JoinedStr(values=values):
                parts = [
                    value.value if isinstance(value, ast.Constant) else self._quoted(place, value, depth)
                    for value in values
                ]
                return ["".join(str(part) for part in parts)]
            case ast.IfExp(body=body, orelse=other):
                return [*self.texts(place, body, depth), *self.texts(place, other, depth)]
            case ast.BoolOp(values=values):
                return [text for value in values for text in self.texts(place, value, depth)]
            case ast.BinOp(left=left, right=right, op=ast.Add()):
                return [a + b for a in self.texts(place, left, depth) for b in self.texts(place, right, depth) or [""]]
            case ast.Subscript(value=ast.Dict(values=values)):
                return [text for value in values for text in self.texts(place, value, depth)]
            case ast.Dict(values=values):
                return [text for value in values for text in self.texts(place, value, depth)]
            case ast.Name(id=name) if depth:
                return self._named(place, name, depth - 1)
            case ast.Attribute(value=ast.Name(id="self"), attr=name) if depth:
                return [
                    text
                    for at, value in self._attributes(place.path, name)
                    for text in self.texts(at, value, depth - 1)
                ]
            case ast.Subscript(value=ast.Name() as table) if depth:
                return self.texts(place, table, depth - 1)
            case ast.Call(func=ast.Attribute(value=value, attr="get")):
                return self.texts(place, value, depth)
            case _:
                return []

    def _quoted(self, place: Place, value: ast.expr, depth: int) -> str:
        """A quoted value: the text of a constant, otherwise a word."""
        inner = value.value if isinstance(value, ast.FormattedValue) else value
        if told := _counted(inner):
            return told[0]
        if isinstance(inner, ast.Name) and (constant := self._constants[place.path].get(inner.id)) is not None:
            if isinstance(constant, ast.Constant):
                return str(constant.value)
            if found := self.texts(place, constant, depth):
                return found[0]
        if isinstance(inner, ast.Name) and depth and place.around is not None:
            told = [text for value in _reaching(place, inner.id) for text in self.texts(place, value, depth - 1)]
            if told:
                return max(told, key=len)
        return word(inner)

    def _attributes(self, path: Path, name: str) -> Iterator[tuple[Place, ast.expr]]:
        """What a file's classes assign to an attribute with this name."""
        for function in (node for node in ast.walk(self.trees[path]) if isinstance(node, ast.FunctionDef)):
            for node in ast.walk(function):
                match node:
                    case ast.Assign(targets=[ast.Attribute(value=ast.Name(id="self"), attr=found)], value=value) if (
                        found == name
                    ):
                        yield Place(path, _NOWHERE, function), value
                    case _:
                        pass

    def _named(self, place: Place, name: str, depth: int) -> list[str]:
        """The possible values of a variable: assignments in the function, the module's constant, or arguments from callers."""
        found: list[str] = []
        if place.around is not None:
            for value in _reaching(place, name):
                found += self.texts(place, value, depth)
            for at, parameter in enumerate(_parameters(place.around)):
                if parameter == name:
                    found += self._given(place.around, at, name, depth)
            defaults = zip(reversed(place.around.args.args), reversed(place.around.args.defaults), strict=False)
            keyword_defaults = zip(place.around.args.kwonlyargs, place.around.args.kw_defaults, strict=True)
            for argument, default in (*defaults, *keyword_defaults):
                if argument.arg == name and default is not None:
                    found += self.texts(place, default, depth)
            found += self._looped(place, name, depth)
        if not found and (constant := self._constants[place.path].get(name)) is not None:
            found = self.texts(place, constant, depth)
        if not found:
            for path, constants in self._constants.items():
                if name in constants and name.isupper() and not name.startswith("_"):
                    found = self.texts(Place(path, place.call, None), constants[name], depth)
        return list(dict.fromkeys(found))

    def _looped(self, place: Place, name: str, depth: int) -> list[str]:
        """The values that a loop over a table of the module gives a name."""
        found = []
        for node in ast.walk(place.around) if place.around else ():
            match node:
                case ast.For(target=ast.Tuple(elts=targets), iter=ast.Name(id=table)):
                    names = [target.id if isinstance(target, ast.Name) else "" for target in targets]
                    constant = self._constants[place.path].get(table)
                    if name in names and isinstance(constant, ast.Tuple | ast.List):
                        rows = [row.elts for row in constant.elts if isinstance(row, ast.Tuple)]
                        found += [text for row in rows for text in self.texts(place, row[names.index(name)], depth)]
                case _:
                    pass
        return found

    def _given(self, function: ast.FunctionDef, at: int, name: str, depth: int) -> list[str]:
        found = []
        for caller in self._calls.get(function.name, []):
            offset = at - (1 if _parameters(function)[:1] in (["self"], ["cls"]) else 0)
            given = [keyword.value for keyword in caller.call.keywords if keyword.arg == name]
            given += caller.call.args[offset : offset + 1] if offset >= 0 else []
            found += [text for value in given for text in self.texts(caller, value, depth)]
        return found


def _counted(value: ast.expr) -> list[str]:
    """A number with its noun, or one of two words, in the plural; none if it is something else."""
    match value:
        case ast.Call(func=ast.Name(id="counted"), args=[number, ast.Constant(value=str() as noun)]):
            return [f"{word(number)} {noun}s"]
        case ast.Call(func=ast.Name(id="counted"), args=[number, _, ast.Constant(value=str() as plural)]):
            return [f"{word(number)} {plural}"]
        case ast.Call(func=ast.Name(id="times"), args=[number]):
            return [f"{word(number)} times"]
        case ast.IfExp(body=ast.Constant(value=str()), orelse=ast.Constant(value=str() as plural)):
            return [plural]
        case _:
            return []


def word(expression: ast.expr) -> str:
    """The placeholder for a quoted value in a message: the last name in it, in capitals."""
    while isinstance(expression, ast.Call | ast.Subscript | ast.FormattedValue | ast.GeneratorExp | ast.IfExp):
        match expression:
            case ast.Call(args=[first, *_]):
                expression = first
            case (
                ast.Call(func=ast.Attribute(value=value)) | ast.Subscript(value=value) | ast.FormattedValue(value=value)
            ):
                expression = value
            case ast.GeneratorExp(elt=value) | ast.IfExp(body=value):
                expression = value
            case _:
                break
    names = [
        node.attr if isinstance(node, ast.Attribute) else node.id
        for node in ast.walk(expression)
        if isinstance(node, ast.Attribute | ast.Name)
    ]
    known = {"strerror": "REASON", "error": "REASON", "why": "REASON"}
    last = names[0] if names else "…"
    return known.get(last, re.sub(r"_(ns|px|s|m|mm|ms)$", "", last).strip("_").upper().replace("_", " "))


def called(call: ast.Call) -> str:
    """The name of what is called; empty if it has none."""
    return (
        call.func.id
        if isinstance(call.func, ast.Name)
        else call.func.attr
        if isinstance(call.func, ast.Attribute)
        else ""
    )


def _parameters(function: ast.FunctionDef) -> list[str]:
    return [argument.arg for argument in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]


def _assigned(nodes: Iterator[ast.AST] | Sequence[ast.AST]) -> Iterator[tuple[str, ast.expr]]:
    """Names and the values assigned to them, with tuples unpacked."""
    for node in nodes:
        match node:
            case (
                ast.Assign(targets=[ast.Name(id=name)], value=value)
                | ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value)
            ):
                yield name, value
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)):
                yield from (
                    (name.id, value) for name, value in zip(names, values, strict=False) if isinstance(name, ast.Name)
                )
            case ast.NamedExpr(target=ast.Name(id=name), value=value):
                yield name, value
            case _:
                pass


def _reaching(place: Place, name: str) -> list[ast.expr]:
    """Assignments to a name above the call: the nearest one and, if that is in a branch, those in the other branches too."""
    assert place.around is not None
    line = place.call.lineno
    depths = [
        statement.col_offset
        for statement in ast.walk(place.around)
        if isinstance(statement, ast.stmt) and statement.lineno <= line <= (statement.end_lineno or 0)
    ]
    found = []
    above = [value for target, value in _assigned(ast.walk(place.around)) if target == name and value.lineno <= line]
    for value in sorted(above, key=lambda value: -value.lineno):
        found.append(value)
        statement = max(
            (
                node
                for node in ast.walk(place.around)
                if isinstance(node, ast.stmt) and node.lineno <= value.lineno <= (node.end_lineno or 0)
            ),
            key=lambda node: node.col_offset,
        )
        if depths and statement.col_offset <= max(depths):
            break
    return found
