"""External C functions and objects: compiled into the FMU, and called by the interpreter with the
same results.
"""

from __future__ import annotations

import ctypes
import os
import subprocess

import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from modelica_interpreter import load_interpreter

from cosim.core.errors import ComponentError, InputError
from cosim.export.fmu.package import write_fmu
from cosim.export.modelica import load_block

HEADER = """#include <stddef.h>
double mean(const double *u, size_t n);
void split(double x, double *sign_of, int *whole, int *is_large);
double checked_root(double x);
"""
SOURCE = """#include "signals.h"
#include "ModelicaUtilities.h"
#include <math.h>
double mean(const double *u, size_t n)
{
    double sum = 0;
    for (size_t k = 0; k < n; k++) sum += u[k];
    return sum / (double)n;
}
void split(double x, double *sign_of, int *whole, int *is_large)
{
    *sign_of = x < 0 ? -1 : 1;
    *whole = (int)x;
    *is_large = fabs(x) > 1;
}
double checked_root(double x)
{
    if (x < 0) ModelicaFormatError("the argument %g is negative\\n", x);
    if (x > 10) ModelicaFormatWarning("the argument %g is large", x);
    return sqrt(x);
}
"""
MODEL = """model M "Functions in C"
  pure function mean
    input Real u[:];
    output Real y;
  external "C" y = mean(u, size(u, 1)) annotation(Include="#include \\"signals.h\\"");
  end mean;
  pure function split
    input Real x;
    output Real s;
    output Integer n;
    output Boolean large;
  external "C" split(x, s, n, large) annotation(Include="#include \\"signals.h\\"");
  end split;
  pure function root
    input Real x;
    output Real y;
  external "C" y = checked_root(x) annotation(Include="#include \\"signals.h\\"");
  end root;
  pure function cube
    input Real x;
    output Real y;
  external "C" y = cube(x) annotation(Include="static double cube(double x) { return x * x * x; }");
  end cube;
  pure function half
    input Real x;
    output Real y;
  external "C" y = half(x) annotation(Library="halves", LibraryDirectory="c");
  end half;
  input Real u;
  output Real y;
  output Real s;
  output Integer n;
  output Boolean large;
  output Real r;
equation
  y = mean({u, 2*u, 1}) + cube(u) + half(0);
  (s, n, large) = split(u);
  r = root(u + 3);
end M;
"""


@pytest.fixture
def signals(tmp_path, monkeypatch):
    """Write the C files to the folder of the model."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "signals.h").write_text(HEADER)
    (tmp_path / "signals.c").write_text(SOURCE)
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "halves.c").write_text("double half(double x) { return x / 2; }\n")


@pytest.mark.usefixtures("signals")
def test_functions_in_c_give_the_same_results_in_the_fmu_and_in_the_interpreter(compile_both):
    model = compile_both(MODEL)
    for _ in model.simulate(50):
        pass
    model.set(u=-1.5)
    model.step(1.0)
    assert [model.get(name) for name in ("s", "n", "large")] == [-1.0, -1, True]
    assert model.get("y") == (-1.5 - 3.0 + 1.0) / 3 + (-1.5 * -1.5) * -1.5


@pytest.mark.usefixtures("signals")
def test_modelica_error_ends_the_step_with_its_text(compile_both):
    model = compile_both(MODEL)
    model.initialize()
    model.set(u=-7)
    reason = "the external function root has failed (M.mo:14): the argument -4 is negative"
    assert model.c.step(0.0, 0.01) == reason
    with pytest.raises(ComponentError, match="the argument -4 is negative"):
        model.python.step(0.0, 0.01)


@pytest.mark.usefixtures("signals")
def test_modelica_warning_is_written_to_the_log_of_the_fmu(tmp_path, write_model, capfd):
    fmu = write_fmu(load_block(write_model(MODEL)), 2, tmp_path / "M.fmu")
    description, folder = read_model_description(str(fmu)), extract(str(fmu), tmp_path / "unpacked")
    instance = FMU2Slave(
        guid=description.guid, unzipDirectory=folder, modelIdentifier="M", instanceName="m"
    )
    instance.instantiate(loggingOn=True)
    instance.setupExperiment()
    instance.enterInitializationMode()
    instance.exitInitializationMode()
    instance.setReal(
        [next(v.valueReference for v in description.modelVariables if v.name == "u")], [12.0]
    )
    instance.doStep(0.0, 0.01)
    instance.freeInstance()
    assert "[WARNING] the argument 15 is large" in capfd.readouterr().out


TABLE = """package Tables
  class Table
    extends ExternalObject;
    function constructor
      input String tableName;
      input String fileName;
      input Real table[:, :];
      input Integer columns[:];
      input Integer smoothness;
      input Integer extrapolation;
      input String label;
      output Table result;
    external "C" result = ModelicaStandardTables_CombiTable1D_init3(
        label, table, size(table, 1), columns, smoothness)
      annotation(Include="#include \\"tables.h\\"");
    end constructor;
    function destructor
      input Table table;
    external "C" ModelicaStandardTables_CombiTable1D_close(table)
      annotation(Include="#include \\"tables.h\\"");
    end destructor;
  end Table;
  pure function value
    input Table table;
    input Integer row;
    output Real y;
  external "C" y = ModelicaStandardTables_CombiTable1D_getValue(table, row)
    annotation(Include="#include \\"tables.h\\"");
  end value;
end Tables;
"""
TABLE_HEADER = """#include <stddef.h>
void *ModelicaStandardTables_CombiTable1D_init3(
    const char *name, const double *values, size_t n, const int *columns, int kind);
void ModelicaStandardTables_CombiTable1D_close(void *table);
double ModelicaStandardTables_CombiTable1D_getValue(void *table, int row);
"""
TABLE_SOURCE = """#include "tables.h"
#include "ModelicaUtilities.h"
#include <stdlib.h>
#include <string.h>
__attribute__((visibility("default"))) int open_tables;
typedef struct { size_t n; double values[]; } Table;
void *ModelicaStandardTables_CombiTable1D_init3(
    const char *name, const double *values, size_t n, const int *columns, int kind)
{
    if (strcmp(name, "curve") != 0) ModelicaFormatError("the table has the name %s", name);
    if (values[0] < 0) ModelicaError("the first value is negative");
    Table *table = malloc(sizeof *table + n * sizeof(double));
    table->n = n;
    for (size_t k = 0; k < n; k++) table->values[k] = values[2 * k + (size_t)columns[0] - 1] * kind;
    open_tables++;
    return table;
}
void ModelicaStandardTables_CombiTable1D_close(void *table)
{
    open_tables--;
    free(table);
}
double ModelicaStandardTables_CombiTable1D_getValue(void *table, int row)
{
    return ((Table *)table)->values[row - 1];
}
"""
TABLE_MODEL = """model M
  parameter String name = "curve";
  parameter Real values[2, 2] = {{1, 2}, {3, 4}};
  parameter Tables.Table table = Tables.Table("NoName", "NoName", values, {2}, 10, 2, name);
  parameter Real first = Tables.value(table, 1);
  input Real u;
  output Real y;
equation
  y = u + Tables.value(table, 2);
end M;
"""


@pytest.fixture
def tables(tmp_path, monkeypatch):
    """Write a package with an external object to the folder of the model."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "Tables"
    (folder / "Resources" / "Include").mkdir(parents=True)
    (folder / "Resources" / "C-Sources").mkdir()
    (folder / "package.mo").write_text(TABLE)
    (folder / "Resources" / "Include" / "tables.h").write_text(TABLE_HEADER)
    (folder / "Resources" / "C-Sources" / "tables.c").write_text(TABLE_SOURCE)


@pytest.mark.usefixtures("tables")
def test_an_external_object_follows_its_parameters_and_is_constructed_again_for_a_restored_state(
    compile_both,
):
    model = compile_both(TABLE_MODEL)
    for _ in model.simulate(3):
        pass
    assert model.get("first") == 20.0
    model.set(values=[[0, 1], [2, 8]], u=1.0)
    assert model.get("first") == 10.0
    model.step(1.0)
    assert model.get("y") == 81.0

    library, memory = model.c._library, model.c._memory
    assert ctypes.c_int.in_dll(library, "open_tables").value == 1, (
        "the object of the old parameters is deleted"
    )
    other = ctypes.create_string_buffer(memory.raw, len(memory))
    library.model_free(memory)
    assert ctypes.c_int.in_dll(library, "open_tables").value == 0
    model.c._memory = other
    assert model.c.step(2.0, 0.01) is None, "a state in other memory has no objects yet"
    assert model.get("y") == 81.0
    model.c.set("values", [[-1, 1], [2, 8]])
    assert "the first value is negative" in (model.c.step(3.0, 0.01) or "")


@pytest.mark.usefixtures("signals")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ("signals.h", "missing.h"),
            r'M.mo:2: mean: the file "missing.h" of its Include annotation is not found',
        ),
        (('external "C" split', 'external "FORTRAN 77" split'), r"M.mo:7: .*FORTRAN 77"),
        (
            ("mean(u, size(u, 1))", "mean(u, 2 * size(u, 1))"),
            "M.mo:2: mean: an argument of a C function must be a variable",
        ),
    ],
)
def test_a_faulty_declaration_is_refused(write_model, change, message):
    with pytest.raises(InputError, match=message):
        load_block(write_model(MODEL.replace(*change)))


@pytest.mark.usefixtures("signals")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("return x * x * x", "return x * x * z"), "M.mo:.*error: .z. undeclared"),
        (
            ("checked_root(x)", "checked_rot(x)"),
            "implicit declaration|undefined reference.*checked_rot",
        ),
    ],
)
def test_code_that_does_not_compile_is_refused_with_the_place(
    tmp_path, write_model, change, message
):
    with pytest.raises(InputError, match=message):
        write_fmu(load_block(write_model(MODEL.replace(*change))), 2, tmp_path / "M.fmu")


@pytest.mark.skipif(
    not os.environ.get("MODELICAPATH"), reason="needs the Modelica Standard Library in MODELICAPATH"
)
def test_tables_of_the_standard_library(compile_both):
    model = compile_both("""model T
  input Real u;
  output Real y;
  Modelica.Blocks.Tables.CombiTable1Ds b(table=[-1, 2; 0, 0; 1, 3; 2, 3.5]);
equation
  b.u = u;
  y = b.y[1];
end T;
""")
    for _, values in model.simulate(50):
        if -1 <= values["u"] <= 2:
            assert model.get("y") == pytest.approx(
                np.interp(values["u"], [-1, 0, 1, 2], [2, 0, 3, 3.5]), abs=1e-14
            )


PREBUILT = """model M
  pure function third
    input Real x;
    output Real y;
  external "C" y = third(x) annotation(Library="thirds", LibraryDirectory="lib");
  end third;
  input Real u;
  output Real y = third(u);
end M;
"""


def test_a_static_library_is_linked(tmp_path, monkeypatch, write_model):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "lib" / "linux64").mkdir(parents=True)
    (tmp_path / "thirds.c").write_text("double third(double x) { return x / 3; }\n")
    subprocess.run(
        ["/usr/bin/env", "gcc", "-c", "-fPIC", "thirds.c", "-o", "thirds.o"],
        cwd=tmp_path,
        check=True,
    )
    subprocess.run(
        ["/usr/bin/env", "ar", "rcs", "lib/linux64/libthirds.a", "thirds.o"],
        cwd=tmp_path,
        check=True,
    )
    model = write_model(PREBUILT)
    fmu = write_fmu(load_block(model), 3, tmp_path / "M.fmu")
    result = simulate_fmu(str(fmu), start_values={"u": 6.0}, stop_time=0.1, output=["y"])
    assert result["y"][-1] == 2.0
    interpreter = load_interpreter(model)
    interpreter.set("u", 7.5)
    interpreter.initialize()
    interpreter.step(0.0, 0.01)
    assert interpreter.get("y") == 2.5


def test_a_library_that_is_not_found_is_refused(write_model):
    with pytest.raises(
        InputError,
        match=(
            r"M.mo:2: third: no file of its Library annotation \(thirds.c, libthirds.a\) is found"
        ),
    ):
        load_block(write_model(PREBUILT))
