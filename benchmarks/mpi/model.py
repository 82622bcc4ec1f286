#!/usr/bin/env python3
"""benchmarks/mpi/model.py: tables, and a picture, of what many ranks cost. The messages are counted
(counts.csv, by counts.sh); the times are a model. benchmarks/table.py writes the tables into benchmarks/README.md,
benchmarks/plot.sh draws the picture.
"""
import csv
import dataclasses
import math
from pathlib import Path

here = Path(__file__).resolve().parent


@dataclasses.dataclass(frozen=True)
class Machine:
    """Of what the model is made; times in s, bandwidths in bytes/s."""
    particle_step: float = 40e-9  # one core, all others busy: two_cubes_8m on two threads takes 38.7 ns a core
    cores: int = 64               # of a machine, one rank each; counts.csv maps ranks to machines with it
    network: float = 25e9         # of a machine, each way: a link of 200 Gbit/s
    inside: float = 4e9           # from rank to rank of one machine while all ranks send; two alone reach 13 GB/s here
    message: float = 2e-6         # a message to another machine; ping-pongs of clusters take 0.9 to 1.6 µs
    message_inside: float = 1e-6  # to a rank of the same machine; 0.1 to 2 µs here
    # Work on shared blocks: times of a trace of 8 ranks (firn_mpi_steps), by what was counted for the same scene.
    clear_piece: float = 10e-9
    pack_node: float = 5.0e-9     # a node into a message of sums
    add_node: float = 3.4e-9      # a node of a piece to the node of the grid
    back_node: float = 3.2e-9     # a node into a message of returned sums
    place_node: float = 2.8e-9    # and out of it
    reach: float = 0.6e-9         # to find the nodes that a particle near a shared block reaches
    grid_node: float = 1e-9       # to clear and update a node that others have as well
    p2g: float = 0.35             # part of a step that P2G takes
    steps_between_sorts: int = 10
    look_home: float = 8e-9       # when sorting: to find the rank of a particle
    record: int = 140             # bytes of a particle that goes to another rank

    def latency(self, ranks):
        """Seconds of one all-reduce of a few bytes: a message for each power of two."""
        steps = math.ceil(math.log2(ranks)) if ranks > 1 else 0
        inside = min(steps, int(math.log2(self.cores)))
        return inside * self.message_inside + (steps - inside) * self.message


@dataclasses.dataclass
class Step:
    """Seconds of one step on the slowest rank."""
    ideal: float      # computing, if all ranks had equally many particles
    computing: float  # of the rank that has most
    shared: float     # work on shared blocks: pieces, packing, adding, nodes that several ranks update
    sums: float       # sums on their way
    returns: float    # and back
    reduction: float
    migration: float  # of particles, one step's part of it
    hidden_half: float
    hidden_all: float

    @property
    def whole(self):
        return self.computing + self.shared + self.sums + self.returns + self.reduction + self.migration

    def efficiency(self, hidden=0.0):
        return self.ideal / (self.whole - hidden)


def read():
    with open(here / "counts.csv", newline="") as file:
        return [{key: value if key in ("scene", "drift", "positions") else float(value) for key, value in row.items()}
                for row in csv.DictReader(file)]


def select(rows, **wanted):
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def step(of, machine=Machine()):
    """The model. `of` is a line of counts.csv; what differs between ranks is taken at its maximum."""
    node = 16
    computing = of["particles_max"] * machine.particle_step
    sent_nodes, returned_nodes = of["sums_max"] / node, of["returns_max"] / node
    shared = (of["pieces_max"] * machine.clear_piece + sent_nodes * machine.pack_node
              + of["mflop_max"] / 4 * machine.add_node + returned_nodes * (machine.back_node + machine.place_node)
              + 64 * of["shared_blocks_max"] * machine.grid_node + of["outer_max"] * machine.reach)
    leaves = of["leaves_rank_mean"] / of["sent_mean"] if of["sent_mean"] else 0  # which part goes to other machines
    transfer = of["leaves_machine_max"] / machine.network + (1 - leaves) * of["sent_max"] / machine.inside
    outside = of["leaves_count_mean"] / of["messages_mean"] if of["messages_mean"] else 0
    message = outside * machine.message + (1 - outside) * machine.message_inside
    share = of["sums_mean"] / of["sent_mean"] if of["sent_mean"] else 0
    # A rank sends two messages of sums to a peer, or one message of returned sums.
    sums = share * transfer + 2 / 3 * of["messages_max"] * message
    returns = (1 - share) * transfer + 1 / 3 * of["messages_max"] * message
    moved = of["migrants_max"] * machine.record
    migration = (moved * (leaves * machine.cores / machine.network + (1 - leaves) / machine.inside)
                 + 2 * moved / machine.inside + of["particles_max"] * machine.look_home) / machine.steps_between_sorts
    ideal = of["all_particles"] / of["ranks"] * machine.particle_step
    # One half of the sums travels while the second half of the particles is scattered. If both sums and returns could
    # travel while particles far from other ranks are scattered and gathered, this could hide more.
    inner = 1 - of["outer_mean"] / of["particles_mean"]
    half = min(sums / 2, machine.p2g * computing / 2)
    all_hidden = min(sums, machine.p2g * computing * inner) + min(returns, (1 - machine.p2g) * computing * inner)
    return Step(ideal, computing, shared, sums, returns, machine.latency(of["ranks"]), migration, half,
                max(half, all_hidden))


def table(head, rows, left=1):
    lines = [head, ["---"] * left + ["---:"] * (len(head) - left), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def mega(value):
    return f"{value / 1e6:.2f}"


def mpi_messages():
    """What a rank sends, by scene and by how far particles have moved since they were sorted."""
    rows = read()
    lines = []
    for text, wanted in (
            ("box, just sorted", dict(scene="box", drift="none")),
            ("box, flow along an axis, on a lattice", dict(scene="box", drift="flow", turn=0, positions="lattice")),
            ("box, flow along an axis, at random", dict(scene="box", drift="flow", turn=0, positions="random")),
            ("box, oblique flow, on a lattice", dict(scene="box", drift="flow", turn=0.6, positions="lattice")),
            ("box, oblique flow, at random", dict(scene="box", drift="flow", turn=0.6, positions="random")),
            ("box, one cell to every side", dict(scene="box", drift="every_side")),
            ("dam break, at random", dict(scene="dam")),
            ("layer of 8 cells, at random", dict(scene="layer")),
            ("spray, 4 particles a block, 64 ranks", dict(scene="spray", ranks=64))):
        found = select(rows, **{"ranks": 1000, **wanted})
        of = found[0]
        lines.append([text, mega(of["sums_mean"]), mega(of["returns_mean"]), mega(of["sent_mean"]),
                      mega(of["sent_max"]), f"{of['peers_mean']:.1f}", f"{of['peers_max']:.0f}",
                      f"{of['mflop_mean'] / 1e6:.2f}", f"{100 * of['leaves_rank_mean'] / of['sent_mean']:.0f} %"])
    return table(["1,000 ranks of 10⁶ particles", "sums, MB", "returns, MB", "both, MB", "both, at most", "peers",
                  "at most", "additions, M", "leave the machine"], lines)


def strong(scene="box"):
    rows = [of for of in select(read(), scene=scene, drift="flow", positions="random", turn=0.6)
            if 0.9e9 < of["all_particles"] < 1.1e9 and math.log2(of["ranks"]).is_integer()]
    return sorted(rows, key=lambda of: of["ranks"])


def mpi_model():
    """A thousand million particles on more and more ranks."""
    lines = []
    for of in strong():
        time = step(of)
        lines.append([f"{of['ranks']:,.0f}", f"{of['particles_mean']:,.0f}",
                      f"{of['particles_max'] / of['particles_mean']:.3f}", mega(of["sent_mean"]),
                      f"{100 * of['leaves_rank_mean'] / of['sent_mean']:.0f} %",
                      *(f"{1e3 * value:.2f}" for value in (time.computing, time.shared, time.sums + time.returns,
                                                           time.migration, time.reduction)),
                      *(f"{100 * time.efficiency(hidden):.0f} %" for hidden in (0, time.hidden_half, time.hidden_all))])
    text = table(["ranks", "particles a rank", "most / mean", "sent, MB", "leave the machine", "computing, ms",
                  "shared blocks", "messages", "migration", "reduction", "efficiency", "half of the sums hidden",
                  "all hidden"], lines, 0)
    fast = Machine(particle_step=24e-9)
    others = "; ".join(f"{of['ranks']:,.0f} ranks: {100 * step(of, fast).efficiency(step(of, fast).hidden_half):.0f} %"
                       for of in strong() if of["ranks"] in (64, 1024, 4096))
    limits = []
    for scene in ("box", "dam", "layer"):
        rows = strong(scene)
        below = [of for of in rows if step(of).efficiency(step(of).hidden_half) < 0.75]
        limits.append(f"{scene}: " + (f"{below[0]['ranks']:,.0f} ranks of {below[0]['particles_mean']:,.0f} particles"
                                      if below else "none"))
    return (f"{text}\n\nWith 24 ns a particle-step, half of the sums hidden: {others}. The first numbers of ranks with "
            f"an efficiency below 75 %: {'; '.join(limits)}.")


def draw(plt, colours, file):
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.9))
    for scene, colour in zip(("box", "dam", "layer"), colours):
        rows = strong(scene)
        ranks = [of["ranks"] for of in rows]
        times = [step(of) for of in rows]
        name = {"box": "box", "dam": "dam break", "layer": "layer"}[scene]
        left.plot(ranks, [100 * time.efficiency() for time in times], ":", color=colour)
        left.plot(ranks, [100 * time.efficiency(time.hidden_half) for time in times], "o-", ms=4, color=colour,
                  label=name)
        left.plot(ranks, [100 * time.efficiency(time.hidden_all) for time in times], "--", color=colour)
    left.plot([], [], ":", color="black", label="no message hidden")
    left.plot([], [], "-", color="black", label="half of the sums hidden")
    left.plot([], [], "--", color="black", label="all hidden that can be")
    left.axvspan(64, 4096, color="#dddddd", alpha=0.35, lw=0)
    left.set(xscale="log", ylim=(0, 102), xlabel="ranks (cores)", ylabel="parallel efficiency [%]",
             title="$10^9$ particles: efficiency")
    left.legend(fontsize=7.5, loc="lower left")
    rows = strong()
    times = [step(of) for of in rows]
    ranks = [of["ranks"] for of in rows]
    for colour, (name, get) in zip(colours, (
            ("computing", lambda time: time.computing), ("messages", lambda time: time.sums + time.returns),
            ("work on shared blocks", lambda time: time.shared), ("migration", lambda time: time.migration),
            ("reduction", lambda time: time.reduction))):
        right.plot(ranks, [1e3 * get(time) for time in times], "o-", ms=3.5, color=colour, label=name)
    right.set(xscale="log", yscale="log", xlabel="ranks (cores)", ylabel="time in a step [ms]",
              title="$10^9$ particles in a box: parts of a step")
    right.legend(fontsize=7.5)
    for axes in (left, right):
        ticks = [64, 512, 4096, 32768]
        axes.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
        axes.minorticks_off()
    figure.text(0.995, 0.005, "counted messages, modelled times: benchmarks/mpi/model.py", ha="right", va="bottom",
                fontsize=6.5, color="#666666")
    figure.tight_layout(rect=(0, 0.02, 1, 1))
    figure.savefig(file)
    plt.close(figure)
    print(file)


if __name__ == "__main__":
    print(mpi_messages(), mpi_model(), sep="\n\n")
