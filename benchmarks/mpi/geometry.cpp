/// \file Counts the messages of a distributed step on many virtual ranks in one process: the partition, the cuts and
/// the messages of a scene alone. Nothing is simulated and MPI is not needed.
///
///     firn_mpi_geometry [--scene box|dam|layer|spray] [--drift none|flow|every_side] [--phases 4] [--random]
///                       [--particles 1e9 | --particles-a-rank 1e6] [--ranks 64,128,…] [--node 64] [--csv FILE]
///                       [--per-block 4] [--thickness 8] [--corner 2] [--turn 0]
///     firn_mpi_geometry --positions FILE [--ranks 2,4,8] [--period 0,0,0] [--double]
///
/// The first form prints, for each number of ranks, means and maxima over ranks. With `--drift flow`, each number is a
/// mean over some phases between two sorts. `--node` is the number of ranks on one machine; neighbours along the curve
/// share it. `--csv` appends a line for each number of ranks to a file.
///
/// The second form prints the bytes that each rank sends to each other rank. A line of the file is one particle:
/// the coordinates of its block, of its base node (both are integers, counted from the lower corner of the domain), and
/// the index of its set.
#include "scenes.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>

namespace {

using geometry::Drift;

struct Options {
    geometry::Scene scene;
    std::vector<int> ranks{2, 4, 8, 16, 32, 64, 128, 256, 512, 1000};
    double particles_a_rank = 1e6;
    bool per_rank = true;
    int phases = 4, node = 64;
    std::string csv{}, positions{};
    geometry::Scheme<3> scheme{};
};

std::vector<int> numbers(const std::string& text) {
    std::vector<int> all;
    std::istringstream words(text);
    for (std::string word; std::getline(words, word, ',');) all.push_back(std::atoi(word.c_str()));
    return all;
}

Options read(int count, char** words) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string name = words[i];
        if (name == "--random") {
            options.scene.lattice = false;
            continue;
        }
        if (name == "--double") {
            options.scheme.node_bytes = firn::node_width * sizeof(double);
            continue;
        }
        if (i + 1 == count) throw std::invalid_argument("The option " + name + " is not known, or lacks its value.");
        const std::string value = words[++i];
        if (name == "--scene")
            options.scene.shape = value;
        else if (name == "--drift" && value == "none")
            options.scene.drift = Drift::none;
        else if (name == "--drift" && value == "flow")
            options.scene.drift = Drift::flow;
        else if (name == "--drift" && value == "every_side")
            options.scene.drift = Drift::every_side;
        else if (name == "--phases")
            options.phases = std::atoi(value.c_str());
        else if (name == "--particles")
            options.scene.particles = std::atof(value.c_str()), options.per_rank = false;
        else if (name == "--particles-a-rank")
            options.particles_a_rank = std::atof(value.c_str());
        else if (name == "--ranks")
            options.ranks = numbers(value);
        else if (name == "--node")
            options.node = std::atoi(value.c_str());
        else if (name == "--csv")
            options.csv = value;
        else if (name == "--per-block")
            options.scene.per_block = std::atof(value.c_str());
        else if (name == "--thickness")
            options.scene.thickness = std::atof(value.c_str());
        else if (name == "--corner")
            options.scene.corner = std::atoi(value.c_str());
        else if (name == "--turn")
            options.scene.turn = std::atof(value.c_str());
        else if (name == "--positions")
            options.positions = value;
        else if (name == "--period") {
            const auto period = numbers(value);
            for (std::size_t a = 0; a < 3 && a < period.size(); ++a) options.scheme.period[a] = period[a];
        } else
            throw std::invalid_argument("The option " + name + " " + value + " is not known.");
    }
    for (const int ranks : options.ranks)
        if (ranks < 1) throw std::invalid_argument("--ranks takes positive numbers, for example 64,128.");
    if (options.phases < 1 || options.node < 1) throw std::invalid_argument("--phases and --node are at least 1.");
    return options;
}

/// Mean and maximum over ranks (or machines) and phases.
struct Figure {
    double mean = 0, max = 0;

    void add(double value, double weight) {
        mean += value * weight;
        max = std::max(max, value);
    }
};

/// What is printed for one number of ranks.
struct Line {
    const char* name;
    double unit;
    Figure figure{};
};

/// Counts a scene on some ranks, and adds the phases up.
void count(const Options& options, const std::vector<std::vector<geometry::BlockMatter<3>>>& phases, int ranks) {
    const auto begin = std::chrono::steady_clock::now();
    std::vector<Line> lines{{"particles", 1},       {"sums", 1e6},  // MB
                            {"returns", 1e6},                       // MB
                            {"sent", 1e6},                          // MB, both
                            {"any_order", 1e6},                     // MB
                            {"messages", 1},        {"peers", 1},         {"pieces", 1}, {"shared_blocks", 1},
                            {"blocks", 1},          {"mflop", 1e6},       {"outer", 1},  // particles
                            {"migrants", 1},        {"leaves_rank", 1e6},  // MB that go to another machine
                            {"leaves_count", 1},                           // messages that go to another machine
                            {"leaves_machine", 1e6}};
    double particles = 0;
    for (const auto& matter : phases) {
        const auto cuts = geometry::cuts<3>(matter, ranks);
        const geometry::Messages messages = geometry::count_messages<3>(matter, {&cuts, 1}, options.scheme);
        std::vector<double> leaves(std::size_t(ranks), 0), leaves_count(leaves);
        for (const auto& [pair, bytes] : messages.pairs) {
            const auto from = std::size_t(pair >> 32), to = std::size_t(pair & 0xffffffffu);
            if (from / std::size_t(options.node) == to / std::size_t(options.node)) continue;
            leaves[from] += double(bytes.sums + bytes.returns);
            leaves_count[from] += double(bytes.messages());
        }
        std::vector<double> of_machine(std::size_t((ranks + options.node - 1) / options.node), 0);
        const double weight = 1 / double(ranks) / double(phases.size());
        particles = 0;
        for (std::size_t r = 0; r < std::size_t(ranks); ++r) {
            const geometry::RankCount& of = messages.ranks[r];
            const double values[] = {double(of.particles),
                                     double(of.sums),
                                     double(of.returns),
                                     double(of.sums + of.returns),
                                     double(of.in_any_order),
                                     double(of.messages),
                                     double(of.peers),
                                     double(of.pieces),
                                     double(of.shared_blocks),
                                     double(of.blocks),
                                     double(of.additions),
                                     double(of.outer),
                                     of.migrants,
                                     leaves[r],
                                     leaves_count[r]};
            for (std::size_t k = 0; k < std::size(values); ++k) lines[k].figure.add(values[k], weight);
            of_machine[r / std::size_t(options.node)] += leaves[r];
            particles += double(of.particles);
        }
        for (const double bytes : of_machine)
            lines.back().figure.add(bytes, 1 / double(of_machine.size()) / double(phases.size()));
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%d ranks, %.4g particles, %.0f of a rank, at most %.3f of the mean (%.1f s)\n", ranks, particles,
                lines[0].figure.mean, lines[0].figure.max / lines[0].figure.mean, seconds);
    for (std::size_t k = 1; k < lines.size(); ++k)
        std::printf("    %-14s mean %10.4g  max %10.4g%s\n", lines[k].name, lines[k].figure.mean / lines[k].unit,
                    lines[k].figure.max / lines[k].unit, lines[k].unit == 1e6 && k != 10 ? " MB" : "");
    if (options.csv.empty()) return;
    const bool exists = std::ifstream(options.csv).good();
    std::ofstream file(options.csv, std::ios::app);
    if (!exists) {
        file << "scene,drift,turn,positions,node,ranks,all_particles";
        for (const Line& line : lines) file << ',' << line.name << "_mean," << line.name << "_max";
        file << '\n';
    }
    const char* const drifts[] = {"none", "flow", "every_side"};
    file << options.scene.shape << ',' << drifts[int(options.scene.drift)] << ',' << options.scene.turn << ','
         << (options.scene.lattice ? "lattice" : "random") << ',' << options.node << ',' << ranks << ',' << particles;
    for (const Line& line : lines) file << ',' << line.figure.mean << ',' << line.figure.max;
    file << '\n';
    if (!file.flush()) throw std::runtime_error("The file " + options.csv + " cannot be written.");
}

void count_scene(const Options& options) {
    std::vector<std::vector<geometry::BlockMatter<3>>> phases;
    double present = -1;
    for (const int ranks : options.ranks) {
        geometry::Scene scene = options.scene;
        if (options.per_rank) scene.particles = options.particles_a_rank * ranks;
        if (scene.particles != present) {
            phases.clear();
            const int count = scene.drift == Drift::flow ? options.phases : 1;
            for (int k = 0; k < count; ++k) {
                scene.phase = (k + 0.5) / count;
                phases.push_back(matter_of(scene));
            }
            present = scene.particles;
        }
        count(options, phases, ranks);
    }
}

/// Reads particles and puts them together block by block.
std::vector<geometry::BlockMatter<3>> read_positions(const std::string& name) {
    std::ifstream file(name);
    if (!file) throw std::runtime_error("The file " + name + " cannot be read.");
    geometry::Gathered<3> gathered;
    std::string line;
    for (std::size_t number = 1; std::getline(file, line); ++number) {
        std::array<int, 3> block{}, node{};
        int set = 0;
        std::istringstream words(line);
        for (int& coordinate : block) words >> coordinate;
        for (int& coordinate : node) words >> coordinate;
        words >> set;
        if (words.fail())
            throw std::runtime_error(name + ", line " + std::to_string(number) +
                                     ": seven integers are needed: a block, a base node and a set.");
        gathered.add(block, node, set);
    }
    return gathered.matter();
}

void count_positions(const Options& options) {
    const auto matter = read_positions(options.positions);
    for (const int ranks : options.ranks) {
        const auto cuts = geometry::cuts<3>(matter, ranks);
        const auto messages = geometry::count_messages<3>(matter, {&cuts, 1}, options.scheme);
        std::printf("%d ranks\n  from    to        sums     returns [bytes]\n", ranks);
        for (int from = 0; from < ranks; ++from)
            for (int to = 0; to < ranks; ++to)
                if (const auto bytes = messages.between(from, to); bytes.sums + bytes.returns > 0)
                    std::printf("%6d%6d%12zu%12zu\n", from, to, bytes.sums, bytes.returns);
    }
}

}  // namespace

int main(int count, char** words) {
    try {
        const Options options = read(count, words);
        if (options.positions.empty()) {
            count_scene(options);
        } else {
            count_positions(options);
        }
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
}
