"""Lowering of Modelica statements to C."""

import json
from dataclasses import dataclass, replace
from itertools import chain

from ..external.c_files import call_signature
from ..model.syntax_tree import (
    Assert,
    Assign,
    Body,
    Call,
    EdgeDetector,
    Expression,
    ExternalCall,
    For,
    If,
    IfStatement,
    Literal,
    MultiAssign,
    Name,
    Solve,
    Statement,
    While,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import (
    assigned_names,
    composed_asserts,
    read_references,
    variable_names,
)
from .c_values import CExpression, CValue, c_identifier, scalar_value
from .expression_lowering import ExpressionLowering

_MAX_CONDITIONAL_LENGTH = 90


@dataclass
class StatementLowering(ExpressionLowering):
    """Lowering of statements."""

    #: true for the initialization, false for an event
    initial: bool = False
    #: name of the function whose body is lowered, or ""
    function: str = ""

    def body(self, body: Body) -> None:
        """Lower several statements."""
        for statement in body:
            self.statement(statement)

    def statement(self, node: Statement) -> None:
        """Lower a statement.

        Raises:
            InputError: The statement contains an unsupported expression.
        """
        getattr(self, f"_{type(node).__name__.lower()}")(node)

    def _assign(self, node: Assign) -> None:
        self.store(self.lower(node.target), node.value, node.target)

    def store(self, target: CValue, value: Expression, reference: Expression) -> None:
        """Lower the assignment of an expression.

        Args:
            target: The value of the assigned variable.
            value: The expression.
            reference: The assigned variable as an expression. It determines whether `value` depends
                on the target.
        """
        while isinstance(value, If) and (known := self.known_branch(value)) is not None:
            value = known
        if isinstance(value, If) and (target.shape or self._needs_if_statement(target, value)):
            self._lower_choice(target, value, reference)
        elif (
            isinstance(value, Call)
            and target.pointer
            and not _variables_read(value) & variable_names(reference)
            and self._can_return_into(value, target)
        ):
            self.lower_call(value, target.pointer)
        else:
            lowered = self.lower(value)
            if lowered.shape not in ((), target.shape):
                sizes = f"found size {list(lowered.shape)}, expected {list(target.shape)}"
                raise_model_error(
                    f"assignment of an array: {sizes}", getattr(reference, "where", None)
                )
            if lowered.shape != target.shape:
                lowered = replace(self.evaluated_once(lowered), shape=target.shape)
            if target.shape and _variables_read(value) & variable_names(reference):
                lowered = self.evaluated_once(replace(lowered, reusable=False))
            self.copy_elements(target, lowered)

    def _can_return_into(self, value: Call, target: CValue) -> bool:
        """Return whether a function can write its result to the target without a copy."""
        shapes, numbers = (
            tuple(map(self.shape_of, value.arguments)),
            tuple(map(self.static_integer, value.arguments)),
        )
        outputs = self.translation_unit.function_instance(value, shapes, numbers).outputs
        return [(output.type, output.shape) for output in outputs] == [(target.type, target.shape)]

    def _needs_if_statement(self, target: CValue, value: If) -> bool:
        if len(value.branches) > 1:
            return True
        with self.collect_lines() as lines:
            text = self.lower(value).text
        return bool(lines) or len(target.text.code) + len(text.code) > _MAX_CONDITIONAL_LENGTH

    def _lower_choice(self, target: CValue, value: If, reference: Expression) -> None:
        """Lower an if-expression to an if-statement.

        An `else if` is nested if its condition requires statements.
        """
        (condition, first), rest = value.branches[0], value.branches[1:]
        self.lines.append(f"if ({self.scalar_of(condition).code}) {{")
        with self.collect_lines() as yes:
            self.store(target, first, reference)
        with self.collect_lines() as no:
            if rest:
                self._lower_choice(target, If(rest, value.otherwise), reference)
            else:
                self.store(target, value.otherwise, reference)
        self._close_if(yes, no)

    def _close_if(self, yes: list[str], no: list[str]) -> None:
        """Append the branches of an if-statement.

        `else { if ... }` is shortened to `else if` where possible.
        """
        self.lines += yes
        is_one_if = no and no[0].startswith("    if (") and no[0].endswith("{")
        if is_one_if and no.index("    }") == len(no) - 1:
            self.lines += ["} else " + no[0].strip(), *(line[4:] for line in no[1:])]
        elif no:
            self.lines += ["} else {", *no, "}"]
        else:
            self.lines.append("}")

    def _ifstatement(self, node: IfStatement) -> None:
        (condition, body), rest = node.branches[0], node.branches[1:]
        if (known := self.static_value(condition)) is not None:
            if known or not rest:
                self.body(body if known else node.otherwise)
            else:
                self._ifstatement(IfStatement(rest, node.otherwise, node.where))
            return
        self.lines.append(f"if ({self.scalar_of(condition).code}) {{")
        with self.collect_lines() as yes:
            self.body(body)
        with self.collect_lines() as no:
            if rest:
                self._ifstatement(IfStatement(rest, node.otherwise, node.where))
            else:
                self.body(node.otherwise)
        self._close_if(yes, no)

    def _for(self, node: For) -> None:
        start, stop = self.scalar_of(node.range.start), self.scalar_of(node.range.stop)
        step = self.static_integer(node.range.step) if node.range.step else 1
        if not step:
            raise_model_error("the step of a for-loop must be a constant other than 0", node.where)
        if not stop.code.lstrip("-").isdigit() and _variables_read(
            node.range.stop
        ) & assigned_names(node.body):
            stop = self.evaluated_once(scalar_value("Integer", stop)).text
        index = c_identifier(node.index)
        first, last = self.static_integer(node.range.start), self.static_integer(node.range.stop)
        bounds = None if first is None or last is None else (min(first, last), max(first, last))
        self.lines.append(
            f"for (int32_t {index} = {start.code}; {index} {'<=' if step > 0 else '>='} "
            f"{stop.code}; {index} += {step}) {{"
        )
        shadowed = self.scope.get(node.index)
        self.scope[node.index] = replace(
            scalar_value("Integer", CExpression(index), reusable=True), bounds=bounds
        )
        with self.collect_lines() as lines:
            self.body(node.body)
        if shadowed is None:
            del self.scope[node.index]
        else:
            self.scope[node.index] = shadowed
        self.lines += [*lines, "}"]

    def _assert(self, node: Assert) -> None:
        if composed_asserts(node):
            self._composed_assert(node)
            return
        condition = self.scalar_of(node.condition)
        text = "".join(str(part.value) for part in node.message if isinstance(part, Literal))
        failure = self.translation_unit.failure_code(text, node.where)
        self.lines.append(f"if (!{condition.parenthesized(13)}) fail(m, {failure});")

    def _composed_assert(self, node: Assert) -> None:
        """Lower a warning, a `terminate`, or an assertion whose message contains values."""
        condition = self.scalar_of(node.condition).parenthesized(13)
        with self.collect_lines() as lines:
            texts, values = zip(*map(self._message_part, node.message), strict=True)
            location = f" ({node.where.file_and_line})" if node.where else ""
            arguments = "".join(f", {value}" for value in values if value)
            text = (
                json.dumps("".join(texts) + location.replace("%", "%%"), ensure_ascii=False)
                + arguments
            )
            if not node.warning:
                self.lines.append(
                    f"{'request_termination' if node.terminates else 'fail_with'}(m, {text});"
                )
        if node.warning:
            number = self.translation_unit.warning_number(node)
            self.lines += [line.removeprefix("    ") for line in lines]
            self.lines.append(f"warn(m, !{condition}, &m->warned[{number}], {text});")
        else:
            self.lines += [f"if (!{condition}) {{", *lines, "}"]

    def _message_part(self, part: Expression) -> tuple[str, str]:
        """Return the format and the C expression of a part of a message, "" for a literal."""
        if isinstance(part, Literal):
            return str(part.value).replace("%", "%%"), ""
        value = self.lower(part)
        if value.type == "Boolean":
            return "%s", f"truth({value.text.code})"
        return ("%g" if value.type == "Real" else "%d"), value.text.code

    def _solve(self, node: Solve) -> None:
        """Lower a system of equations to a loop of Newton's method."""
        n, failure = (
            len(node.unknowns),
            self.translation_unit.failure_code("a system of equations has no solution", node.where),
        )
        unknowns = ", ".join(f"&{self.lower(unknown).text.code}" for unknown in node.unknowns)
        with self.collect_lines() as lines:
            self.lines.append(f"double residual[{n}], jacobian[{n * n}];")
            for k, residual in enumerate(node.residuals):
                self.lines.append(f"residual[{k}] = {self.scalar_of(residual).code};")
            for k, derivative in enumerate(chain.from_iterable(node.jacobian)):
                self.lines.append(f"jacobian[{k}] = {self.scalar_of(derivative).code};")
            arguments = (
                f"m, {n}, (double *[]){{{unknowns}}}, residual, jacobian, step, scale, &search, "
                f"iteration, {failure}"
            )
            self.lines.append(f"if (newton({arguments})) break;")
        state = [f"double step[{n}], scale[{n}];", "NewtonSearch search;"]
        self.lines += ["{", *state, "for (int iteration = 0;; iteration++) {", *lines, "}", "}"]

    def _externalcall(self, node: ExternalCall) -> None:
        """Lower the body of an external function."""
        function = self.translation_unit.functions[self.function]
        signature, outputs = call_signature(function), {output.name for output in function.outputs}
        arguments = ["m"] * signature.is_constructor
        for expression, argument in zip(node.arguments, signature.arguments, strict=True):
            value = self.lower(expression)
            if argument.is_array:
                arguments += [
                    self.as_c_array(value, argument.type),
                    *[str(value.size)] * signature.is_constructor,
                ]
            elif isinstance(expression, Name) and expression.name in outputs:
                arguments.append(f"&{value.text.code}")
            else:
                arguments.append(
                    f"object(m, {value.text.code})"
                    if argument.type == "ExternalObject"
                    else value.text.code
                )
        arguments += [f"&{self.lower(node.result).text.code}"] if node.result else []
        failure = self.translation_unit.failure_code(
            f"the external function {function.name} has failed", node.where
        )
        self.lines.append(f"if (!{signature.name}({', '.join(arguments)})) fail(m, {failure});")

    def _while(self, node: While) -> None:
        with self.collect_lines() as lines:
            self.lines.append(f"if (!{self.scalar_of(node.condition).parenthesized(13)}) break;")
            self.body(node.body)
        self.lines += ["for (;;) {", *lines, "}"]

    def _multiassign(self, node: MultiAssign) -> None:
        for target, result in zip(node.targets, self.lower_call(node.call), strict=False):
            self.copy_elements(self.lower(target), result)

    def _edgedetector(self, node: EdgeDetector) -> None:
        """Set the flag risen(k) if the condition has become true since the previous event."""
        condition = self.scalar_of(node.condition).code
        if self.initial:
            self.lines.append(f"m->held[{node.index}] = {condition};")
            return
        self.lines += [
            f"const bool holds_{node.index} = {condition};",
            f"risen[{node.index}] = holds_{node.index} && !m->held[{node.index}];",
            f"m->held[{node.index}] = holds_{node.index};",
        ]


def _variables_read(node: Expression) -> set[str]:
    """Return the variables whose current value an expression reads."""
    return {referenced_variable(reference) for reference in read_references(node)}
