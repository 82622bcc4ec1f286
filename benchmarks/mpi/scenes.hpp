/// \file Scenes for counting messages, block by block: no particle is stored.
#pragma once

#include <firn/data/random.hpp>

#include "messages.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace geometry {

/// How far particles have moved since they were sorted.
enum class Drift {
    none,        ///< they were sorted just now
    flow,        ///< along the scene's flow; the fastest particle has moved by the phase [cells]
    every_side,  ///< one cell to every side in every block: no step can have more nodes
};

/// Eight particles a cell (spray has fewer), all of one set.
struct Scene {
    std::string shape = "box";  ///< box, dam, layer or spray
    double particles = 1e6;     ///< about how many
    Drift drift = Drift::every_side;
    double phase = 1;      ///< how far the fastest particle has moved since the last sort [cells]
    bool lattice = true;   ///< particles at ¼ and ¾ of each cell; if not, at any place in it
    double per_block = 4;  ///< of spray: particles in a block, on average
    double thickness = 8;  ///< of the layer [cells]
    int corner = 0;        ///< lower corner of the scene along each axis [blocks]; 0: at the walls
    double turn = 0;       ///< angle of the flow in its plane [radians]; a box and a layer move along it

    /// Names of all shapes.
    static std::vector<std::string> shapes() { return {"box", "dam", "layer", "spray"}; }
};

namespace detail {

/// The matter of a scene along one axis of one block.
struct Line {
    int particles = 0;         // that were sorted into the block
    double low = 0, high = 0;  // positions of the outermost [cells], less half a cell: of their base nodes
};

/// Returns the particles of a column of cells from 0 to `cells` whose base nodes lie in a block.
inline Line line(int block, double cells, bool lattice) {
    Line line;
    for (int i = 0; i < 2 * block_size; ++i) {
        const double x = block_size * block + 0.25 + 0.5 * i;  // position less half a cell
        if (x + 0.5 < 0 || x + 0.5 > cells) continue;
        if (line.particles++ == 0) line.low = lattice ? x : x - 0.25;
        line.high = lattice ? x : x + 0.249;
    }
    return line;
}

}  // namespace detail

/// Returns the matter of a scene, sorted along the curve.
/// \throws std::invalid_argument  if the shape has no such name
inline std::vector<BlockMatter<3>> matter_of(const Scene& scene) {
    using Cells = std::array<double, 3>;
    const double cells = scene.particles / 8;
    Cells extent{};
    double height = 0;
    if (scene.shape == "box") {
        extent.fill(std::round(std::cbrt(cells)));
    } else if (scene.shape == "dam") {
        // Ritter's solution for a column of water (height × 2 height × 2 height) at the time when its back begins to
        // sink: the surface falls as a parabola to 0 over three lengths of the column.
        height = std::round(std::cbrt(cells / 4));
        extent = {6 * height, height, 2 * height};
    } else if (scene.shape == "layer") {
        const double side = std::round(std::sqrt(cells / scene.thickness));
        extent = {side, scene.thickness, side};
    } else if (scene.shape == "spray") {
        extent.fill(block_size * std::round(std::cbrt(scene.particles / scene.per_block)));
    } else {
        throw std::invalid_argument("There is no scene '" + scene.shape + "'. Scenes: box, dam, layer, spray.");
    }
    const bool spray = scene.shape == "spray";

    // The flow at a point [cells]: 1 is the largest speed.
    const auto flow = [&](const Cells& x) -> Cells {
        if (scene.shape == "dam") {  // the front runs at 1, the back stands still; matter sinks as it spreads
            const double s = x[0] / extent[0];
            return {s, -x[1] / extent[0], 0};
        }
        return {std::cos(scene.turn), std::sin(scene.turn) * 0.8, std::sin(scene.turn) * 0.6};
    };
    const auto surface = [&](double x) {  // of the dam
        const double s = 1 - std::min(x / extent[0], 1.0);
        return height * s * s;
    };

    std::vector<BlockMatter<3>> matter;
    std::array<int, 3> blocks{};
    for (std::size_t a = 0; a < 3; ++a) blocks[a] = int(extent[a]) / block_size + 1;
    firn::BlockCoordinate<3> at{};
    for (at[0] = -1; at[0] <= blocks[0]; ++at[0])
        for (at[1] = -1; at[1] <= blocks[1]; ++at[1])
            for (at[2] = -1; at[2] <= blocks[2]; ++at[2]) {
                BlockMatter<3> of;
                Cells low{}, high{}, middle{};
                for (std::size_t a = 0; a < 3; ++a) {
                    of.block[a] = at[a] + scene.corner;
                    middle[a] = block_size * (at[a] + 0.5);
                }
                if (spray) {
                    bool inside = true;
                    for (std::size_t a = 0; a < 3; ++a) inside = inside && at[a] >= 0 && at[a] < blocks[a] - 1;
                    if (!inside) continue;
                    firn::RandomSequence random(firn::block_key<3>(of.block));
                    const auto uniform = [&] { return firn::unit_interval(random.bits()); };
                    // Poisson's distribution: events in unit time, between which times are exponential.
                    for (double time = -std::log1p(-uniform()); time < scene.per_block;
                         time -= std::log1p(-uniform())) {
                        for (std::size_t a = 0; a < 3; ++a) {
                            double x = block_size * (at[a] + uniform());
                            if (scene.drift == Drift::flow) x += scene.phase * (2 * uniform() - 1);
                            low[a] = of.particles == 0 ? x : std::min(low[a], x);
                            high[a] = of.particles == 0 ? x : std::max(high[a], x);
                        }
                        ++of.particles;
                    }
                } else {
                    Cells here = extent;
                    if (height > 0) here[1] = surface(middle[0]);
                    const Cells moved = scene.drift == Drift::flow ? flow(middle) : Cells{};
                    for (std::size_t a = 0; a < 3; ++a) of.moved[a] = float(moved[a]);
                    of.particles = 1;
                    for (std::size_t a = 0; a < 3; ++a) {
                        const detail::Line line = detail::line(at[a], here[a], scene.lattice);
                        of.particles *= unsigned(line.particles);
                        low[a] = line.low + scene.phase * moved[a];
                        high[a] = line.high + scene.phase * moved[a];
                    }
                }
                if (of.particles == 0) continue;
                for (std::size_t a = 0; a < 3; ++a) {
                    const auto node = [&](double x) {
                        return std::int8_t(std::clamp(int(std::floor(x)) - block_size * at[a], -firn::allowed_drift,
                                                      block_size - 1 + firn::allowed_drift));
                    };
                    const bool all = scene.drift == Drift::every_side;
                    of.first[a] = all ? std::int8_t(-firn::allowed_drift) : node(low[a]);
                    of.last[a] = all ? std::int8_t(block_size - 1 + firn::allowed_drift) : node(high[a]);
                }
                matter.push_back(of);
            }
    sort_along_curve(matter);
    return matter;
}

}  // namespace geometry
