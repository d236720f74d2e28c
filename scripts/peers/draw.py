"""Pictures: of peers.csv, a line a job, a mark a peer, how many times as long as ours it takes; and of drift-peers.csv."""
import pathlib
import shutil
import subprocess

OURS = "leastaction"
COLOURS = "#b8261b", "#d55e00", "#7a3fa0", "#f2b134", "#009e73", "#56b4e9", "#606060", "#a8703a", "#d05090"


def script(rows, picture, origin):
    shown = [r for r in rows if not r["peer"].startswith(OURS) and r["peer"] != "C by hand"]
    jobs = list(dict.fromkeys(r["job"] for r in shown))
    peers = list(dict.fromkeys(r["peer"].split(" (")[0] for r in shown))
    lines = [
        f"set terminal svg size 900,{120 + 17 * len(jobs)} font 'Helvetica,12' background 'white'",
        f"set output '{picture}'",
        f"set label 1 '{origin}' at screen 0.004,0.015 left font ',7' textcolor rgb '#808080' noenhanced",
        "set title 'The same jobs in other tools, one thread: times as long as leastaction'",
        "set bmargin 5",
        "set logscale x",
        "set xrange [0.2:*]",
        f"set yrange [{len(jobs) - 0.4}:-0.6]",
        "set grid x lt 1 lc rgb '#e6e6e6'",
        "set border 3",
        "set tics nomirror",
        "set xlabel 'times as long as leastaction; left of the line the other is faster'",
        "set key outside right top Left reverse samplen 1 noenhanced",
        "set arrow from 1,graph 0 to 1,graph 1 nohead lw 1.5 lc rgb '#303030'",
        "set ytics noenhanced (" + ",".join(f"'{job}' {k}" for k, job in enumerate(jobs)) + ")",
    ]
    for k, job in enumerate(jobs):
        lines.append(
            f"set arrow from graph 0,first {k} to graph 1,first {k} nohead lw 0.4 lc rgb '#e6e6e6' back"
        )
    plots = []
    for k, peer in enumerate(peers):
        data = [(r["ratio"], jobs.index(r["job"])) for r in shown if r["peer"].split(" (")[0] == peer]
        lines += [f"$peer{k} << EOD", *(f"{x} {y}" for x, y in data), "EOD"]
        colour = COLOURS[k % len(COLOURS)]
        plots.append(f"$peer{k} using 1:2 with points pt 7 ps 0.8 lc rgb '{colour}' title '{peer}'")
    return "\n".join([*lines, "plot " + ", ".join(plots), ""])


def drift_script(rows, picture):
    lines = [
        "set terminal svg size 720,420 font 'Helvetica,12' background 'white'",
        f"set output '{picture}'",
        "set title 'Energy of Kepler orbits at the tightest tolerances, e = 0.52 to 0.68'",
        "set logscale xy",
        "set format '10^{%L}'",
        "set grid lt 1 lc rgb '#e6e6e6'",
        "set border 3",
        "set tics nomirror",
        "set xlabel 'orbits'",
        "set ylabel 'relative error, root mean square'",
        "set key top left Left reverse noenhanced",
    ]
    plots = []
    for k, method in enumerate(dict.fromkeys(r["method"] for r in rows)):
        mine = [r for r in rows if r["method"] == method]
        lines += [f"$m{k} << EOD", *(f"{r['orbits']} {r['error']}" for r in mine), "EOD"]
        title = f"{method}, orbits^{mine[0]['exponent']}"
        plots.append(f"$m{k} with linespoints pt 7 ps 0.6 lw 1.5 lc rgb '{COLOURS[k]}' title '{title}'")
    return "\n".join([*lines, "plot " + ", ".join(plots), ""])


def gnuplot(text):
    subprocess.run(["gnuplot"], input=text, text=True, check=True)


def draw_drift(rows, stem):
    """STEM.svg: energy errors over the number of orbits, where there is gnuplot."""
    if shutil.which("gnuplot"):
        gnuplot(drift_script(rows, f"{stem}.svg"))


def draw(rows, stem, origin):
    """STEM.svg, where there is gnuplot and anything to draw."""
    picture = pathlib.Path(f"{stem}.svg")
    if shutil.which("gnuplot") and any(not r["peer"].startswith(OURS) for r in rows):
        gnuplot(script(rows, picture, origin))
