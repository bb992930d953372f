"""The data file of a figure contains its curves and bars."""

import csv

from matplotlib.figure import Figure

from cosim.report.figures import write_figure_data


def table(figure, folder):
    assert write_figure_data(figure, folder / "numbers.csv")
    with (folder / "numbers.csv").open(newline="") as file:
        return [tuple(row) for row in csv.reader(file)]


def test_every_curve_of_every_panel_is_listed(tmp_path):
    figure = Figure()
    above, below = figure.subplots(2, sharex=True)
    above.set_ylabel("z / m")
    above.plot([0.0, 0.1], [1.0, 2.0], label="deck")
    below.set(ylabel="horizontal\nerror / m", xlabel="t / s")
    below.plot([0.0], [1 / 3])
    assert table(figure, tmp_path) == [
        ("panel", "curve", "t / s", "value"),
        ("z / m", "deck", "0.0", "1.0"),
        ("z / m", "deck", "0.1", "2.0"),
        ("horizontal error / m", "", "0.0", "0.3333333333333333"),
    ]


def test_unnamed_markers_and_limits_are_not_written(tmp_path):
    figure = Figure()
    axes = figure.add_subplot(xlabel="x / m", ylabel="y / m")
    axes.plot([1.0], [2.0], "o")
    axes.axhline(0.1, label="limit")
    axes.plot([3.0], [4.0], "*", label="touchdown")
    assert table(figure, tmp_path)[1:] == [("y / m", "touchdown", "3.0", "4.0")]


def test_bars_are_listed_by_their_names(tmp_path):
    figure = Figure()
    axes = figure.add_subplot(ylabel="factor")
    axes.bar([0, 1], [10.0, 20.5], label="cosim")
    axes.set_xticks([0, 1], ["short\nrun", "long"])
    assert table(figure, tmp_path)[1:] == [
        ("factor", "cosim", "short run", "10.0"),
        ("factor", "cosim", "long", "20.5"),
    ]


def test_a_figure_without_data_writes_no_file(tmp_path):
    figure = Figure()
    figure.add_subplot().imshow([[0, 1]])
    assert not write_figure_data(figure, tmp_path / "numbers.csv")
    assert list(tmp_path.iterdir()) == []
