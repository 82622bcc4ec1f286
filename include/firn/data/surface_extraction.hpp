/// \file The triangles at a level of a field on a sparse lattice, by marching cubes: the third part of
/// firn/data/surface.hpp.
#pragma once

#include <firn/data/marching_cubes.hpp>
#include <firn/data/surface_field.hpp>

#include <memory>

namespace firn::inline FIRN_BUILD::detail {

/// Makes a mesh from the blocks of a lattice, block by block; vertices are numbered in the order of blocks, nodes and
/// axes.
/// \tparam Lattice  has what SurfaceLattice has of blocks
template <class Lattice>
class SurfaceExtraction {
public:
    /// \param level  of the field; what is above it is inside
    SurfaceExtraction(const Lattice& lattice, double level) : lattice_(lattice), level_(float(level)) {}

    /// Returns the mesh. \param block_of  gets the block of each vertex
    /// \throws parameter_error  if it has more vertices or triangles than TriangleMesh can number
    TriangleMesh mesh(std::vector<std::uint32_t>& block_of) {
        const std::size_t n = lattice_.blocks();
        const int workers = thread_count(lattice_.threads());
        std::vector<std::size_t> vertices(n + 1), triangles(n + 1);  // of the blocks before
        numbers_.resize(n);
        parallel_for(n, workers, [&](std::size_t b, int) { count(b, vertices[b + 1], triangles[b + 1]); });
        for (std::size_t b = 0; b < n; ++b) vertices[b + 1] += vertices[b], triangles[b + 1] += triangles[b];
        constexpr auto most = std::size_t(std::numeric_limits<std::int32_t>::max());
        if (std::max(vertices[n], triangles[n]) > most)
            throw parameter_error(sentence("The surface would have ", vertices[n], " vertices and ", triangles[n],
                                           " triangles; a mesh has at most ", most, ". Give a larger cell_size."));
        TriangleMesh mesh;
        mesh.vertices.resize(vertices[n]);
        mesh.triangles.resize(triangles[n]);
        block_of.resize(vertices[n]);
        parallel_for(n, workers, [&](std::size_t b, int) {
            if (numbers_[b]) place(b, vertices[b], mesh, block_of);
        });
        parallel_for(n, workers, [&](std::size_t b, int) {
            if (triangles[b + 1] > triangles[b]) connect(b, triangles[b], mesh);
        });
        return mesh;
    }

private:
    static constexpr int side = Lattice::side, more = side + 1;
    /// The values at the nodes of a block and those one further.
    using Values = std::array<float, std::size_t(more* more* more)>;
    /// For each edge that begins at a node of a block, along x, y and z, its vertex.
    using Numbers = std::array<std::int32_t, 3 * Lattice::nodes>;

    static std::size_t at(int i, int j, int k) { return std::size_t(i + more * (j + more * k)); }

    /// Gets the values of a block. Returns whether some are inside and some are outside.
    bool get(std::size_t b, Values& values) const {
        const auto near = lattice_.from(lattice_.block(b));
        bool inside = false, outside = false;
        for (int k = 0; k < more; ++k)
            for (int j = 0; j < more; ++j)
                for (int i = 0; i < more; ++i) {
                    const std::size_t block = near[std::size_t(i / side + 2 * (j / side) + 4 * (k / side))];
                    const float value = block == lattice_.blocks()
                                            ? 0.0F
                                            : lattice_.values(block)[Lattice::node(i % side, j % side, k % side)];
                    values[at(i, j, k)] = value;
                    (value > level_ ? inside : outside) = true;
                }
        return inside && outside;
    }
    /// Calls f(case, i, j, k) for each cell that the surface crosses.
    template <class F>
    void for_cells(const Values& values, const F& f) const {
        for (int k = 0; k < side; ++k)
            for (int j = 0; j < side; ++j)
                for (int i = 0; i < side; ++i) {
                    unsigned inside = 0;
                    for (int n = 0; n < 8; ++n)
                        inside |= unsigned(values[at(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2))] > level_) << n;
                    if (inside != 0 && inside != 255) f(cell_cases[inside], i, j, k);
                }
    }
    /// Calls f(i, j, k, axis, share) for each edge that the surface crosses and that begins at a node of the block.
    template <class F>
    void for_edges(const Values& values, const F& f) const {
        for (int k = 0; k < side; ++k)
            for (int j = 0; j < side; ++j)
                for (int i = 0; i < side; ++i)
                    for (int axis = 0; axis < 3; ++axis) {
                        const float start = values[at(i, j, k)],
                                    end = values[at(i + (axis == 0), j + (axis == 1), k + (axis == 2))];
                        if ((start > level_) == (end > level_)) continue;
                        // Not on a node, so that no triangle has two corners at one place.
                        f(i, j, k, axis, std::clamp((level_ - start) / (end - start), 0.01F, 0.99F));
                    }
    }

    void count(std::size_t b, std::size_t& vertices, std::size_t& triangles) {
        Values values;
        if (!get(b, values)) return;
        for_edges(values, [&](int, int, int, int, float) { ++vertices; });
        for_cells(values, [&](const CellCase& cell, int, int, int) { triangles += std::size_t(cell.triangles); });
        if (vertices > 0) numbers_[b] = std::make_unique<Numbers>();
    }
    void place(std::size_t b, std::size_t first, TriangleMesh& mesh, std::vector<std::uint32_t>& block_of) {
        Values values;
        get(b, values);
        const BoxIndex block = lattice_.block(b);
        for_edges(values, [&](int i, int j, int k, int axis, float share) {
            Vec<double, 3> x{double(side * block[0] + i), double(side * block[1] + j), double(side * block[2] + k)};
            x[axis] += double(share);
            (*numbers_[b])[3 * Lattice::node(i, j, k) + std::size_t(axis)] = std::int32_t(first);
            block_of[first] = std::uint32_t(b);
            mesh.vertices[first++] = x * lattice_.cell();
        });
    }
    void connect(std::size_t b, std::size_t first, TriangleMesh& mesh) const {
        Values values;
        get(b, values);
        const auto near = lattice_.from(lattice_.block(b));
        for_cells(values, [&](const CellCase& cell, int i, int j, int k) {
            const auto vertex = [&](int edge) {
                const int corner = first_corner(edge), x = i + (corner & 1), y = j + (corner >> 1 & 1),
                          z = k + (corner >> 2);
                const auto& numbers = *numbers_[near[std::size_t(x / side + 2 * (y / side) + 4 * (z / side))]];
                return numbers[3 * Lattice::node(x % side, y % side, z % side) + std::size_t(edge / 4)];
            };
            for (int t = 0; t < cell.triangles; ++t) {
                const std::int8_t* const corner = cell.corners.data() + 3 * t;
                mesh.triangles[first++] = {vertex(corner[0]), vertex(corner[1]), vertex(corner[2])};
            }
        });
    }

    const Lattice& lattice_;
    float level_;
    std::vector<std::unique_ptr<Numbers>> numbers_;  // of blocks that the surface crosses
};

/// Removes the shells of a closed mesh that face inwards and enclose little: cavities.
/// \param block_of  has a number for each vertex
/// \param most      the volume of the largest that are removed [m³]
inline void fill_cavities(TriangleMesh& mesh, std::vector<std::uint32_t>& block_of, double most) {
    const std::size_t n = mesh.vertices.size();
    std::vector<std::uint32_t> root(n);  // of a shell: its first vertex
    std::iota(root.begin(), root.end(), 0U);
    const auto root_of = [&](std::uint32_t v) {
        while (root[v] != v) v = root[v] = root[root[v]];
        return v;
    };
    for (const auto& corners : mesh.triangles)
        for (const auto other : {corners[1], corners[2]}) {
            const auto a = root_of(std::uint32_t(corners[0])), b = root_of(std::uint32_t(other));
            root[std::max(a, b)] = std::min(a, b);
        }
    for (std::uint32_t v = 0; v < n; ++v) root[v] = root[root[v]];  // that of a lower vertex is right already
    std::vector<double> volume(n);
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto& apex = mesh.vertices[root[std::size_t(a)]];
        volume[root[std::size_t(a)]] +=
            dot(mesh.vertices[std::size_t(a)] - apex,
                cross(mesh.vertices[std::size_t(b)] - apex, mesh.vertices[std::size_t(c)] - apex)) /
            6;
    }
    std::vector<std::int32_t> number(n, -1);
    std::size_t kept = 0;
    for (std::size_t v = 0; v < n; ++v) {
        if (volume[root[v]] <= 0 && -volume[root[v]] <= most) continue;
        mesh.vertices[kept] = mesh.vertices[v];
        block_of[kept] = block_of[v];
        number[v] = std::int32_t(kept++);
    }
    if (kept == n) return;
    mesh.vertices.resize(kept);
    block_of.resize(kept);
    std::erase_if(mesh.triangles, [&](const auto& corners) { return number[std::size_t(corners[0])] < 0; });
    for (auto& corners : mesh.triangles)
        for (auto& v : corners) v = number[std::size_t(v)];
}

/// The triangles around each vertex of a mesh, in ascending order.
class TrianglesAround {
public:
    explicit TrianglesAround(const TriangleMesh& mesh)
        : first_(mesh.vertices.size() + 1), all_(3 * mesh.triangles.size()) {
        for (const auto& corners : mesh.triangles)
            for (const auto v : corners) ++first_[std::size_t(v) + 1];
        for (std::size_t v = 0; v + 1 < first_.size(); ++v) first_[v + 1] += first_[v];
        auto next = first_;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            for (const auto v : mesh.triangles[t]) all_[next[std::size_t(v)]++] = std::uint32_t(t);
    }
    std::span<const std::uint32_t> of(std::size_t v) const {
        return std::span(all_).subspan(first_[v], first_[v + 1] - first_[v]);
    }

private:
    std::vector<std::size_t> first_;
    std::vector<std::uint32_t> all_;
};

/// Smooths a closed mesh: `passes` times, each vertex goes half the way to the mean of its neighbours, and then 0.53 of
/// the way back (Taubin 1995), which keeps volumes.
inline void smooth(TriangleMesh& mesh, const TrianglesAround& around, int passes, int threads) {
    std::vector<Vec<double, 3>> from;
    for (int half = 0; half < 2 * passes; ++half) {
        from = mesh.vertices;
        for_chunks(from.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t v = first; v < last; ++v) {
                Vec<double, 3> sum{};  // each neighbour is in two triangles
                const auto triangles = around.of(v);
                for (const auto t : triangles)
                    for (const auto w : mesh.triangles[t])
                        if (std::size_t(w) != v) sum += from[std::size_t(w)];
                const auto mean = sum * (0.5 / double(triangles.size()));
                mesh.vertices[v] = from[v] + (mean - from[v]) * (half % 2 == 0 ? 0.5 : -0.53);
            }
        });
    }
}

/// Returns a normal for each vertex: the mean of its triangles', weighted by area.
inline std::vector<Vec<double, 3>> vertex_normals(const TriangleMesh& mesh, const TrianglesAround& around,
                                                  int threads) {
    std::vector<Vec<double, 3>> normals(mesh.vertices.size());
    for_chunks(normals.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t v = first; v < last; ++v) {
            Vec<double, 3> sum{};
            for (const auto t : around.of(v)) {
                const auto& [a, b, c] = mesh.triangles[t];
                const auto& origin = mesh.vertices[std::size_t(a)];
                sum += cross(mesh.vertices[std::size_t(b)] - origin, mesh.vertices[std::size_t(c)] - origin);
            }
            const double length = norm(sum);
            normals[v] = length > 0 ? sum * (1 / length) : Vec<double, 3>{0, 1, 0};
        }
    });
    return normals;
}

}  // namespace firn::inline FIRN_BUILD::detail
