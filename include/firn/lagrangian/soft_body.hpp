/// \file Builds soft bodies: a lattice of cells that fills a shape, or a closed surface with support links inside it.
#pragma once

#include <firn/data/mesh_shells.hpp>
#include <firn/data/samples.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/surface.hpp>

#include <bit>
#include <map>
#include <numbers>
#include <set>

namespace firn::inline FIRN_BUILD {

/// A net whose facets enclose a volume. Each point of the net represents a part of this volume.
template <int D>
struct SoftBody {
    Net<D> net;                   ///< Points, links and facets.
    std::vector<double> volumes;  ///< For each point: its part of the enclosed volume [m³; m² in 2D].

    /// Returns the mass of every point [kg], in the order of the points, for a body of `density` [kg/m³].
    /// \throws parameter_error  unless the density is positive and finite
    std::vector<double> masses(double density) const {
        detail::check_positive(density, "The density of the body", "kg/m^3");
        auto masses = volumes;
        for (auto& mass : masses) mass *= density;
        return masses;
    }
};

namespace detail {

/// A set of lattice cells, which are cubes, or squares in 2D. A cell is given by its index along each axis, counted
/// from the cell of the first sample.
template <int D>
class Cells {
public:
    using Index = std::array<std::int64_t, D>;
    static constexpr std::uint32_t corners = 1u << D;

    /// Makes one cell around each sample.
    /// \param samples  the centres of the cells
    /// \param side     side length of a cell [m]
    /// \throws parameter_error  unless all samples lie on one lattice with spacing `side`, each at its own position
    explicit Cells(const Samples<D>& samples, double side) {
        const Vec<double, D> first = samples.positions.front();
        for (const auto& x : samples.positions) {
            Index cell{};
            for (int a = 0; a < D; ++a) {
                const double steps = (x[a] - first[a]) / side;
                if (!(std::abs(steps) < 1e9) || std::abs(steps - std::round(steps)) > 1e-6)
                    throw parameter_error(sentence("The sample at ", describe(x), " m does not lie on the lattice of ",
                                                   side, " m through ", describe(first),
                                                   " m. Fill the shape with Pattern::lattice."));
                cell[std::size_t(a)] = std::int64_t(std::llround(steps));
            }
            if (!cells_.insert(cell).second)
                throw parameter_error(sentence("Two samples lie at ", describe(x), " m; give each sample once."));
        }
    }

    const std::set<Index>& all() const { return cells_; }
    bool has(const Index& cell) const { return cells_.contains(cell); }

    /// Adds cells where two cells touch only along an edge (in 2D: at a corner): one of the two common neighbours of
    /// these cells is added. Otherwise the two cells could turn about the edge as about a hinge.
    void fill_hinges() {
        std::vector<Index> open(cells_.begin(), cells_.end());
        while (!open.empty()) {
            const Index cell = open.back();
            open.pop_back();
            for_pairs_of_axes([&](std::size_t a, std::size_t b) {
                for (const int up_a : {-1, 1}) {
                    for (const int up_b : {-1, 1}) {
                        const Index beside = moved(cell, a, up_a), across = moved(beside, b, up_b);
                        if (!has(across) || has(beside) || has(moved(cell, b, up_b))) continue;
                        cells_.insert(beside);
                        open.push_back(beside);
                    }
                }
            });
        }
    }

    /// Checks that the cells form one connected body. Two cells are connected if they share a face (in 2D: an edge).
    /// \throws parameter_error  if the cells form several bodies
    void check_connected() const {
        std::set<Index> left = cells_;
        std::vector<Index> open{*left.begin()};
        left.erase(left.begin());
        while (!open.empty()) {
            const Index cell = open.back();
            open.pop_back();
            for (std::size_t a = 0; a < D; ++a)
                for (const int up : {-1, 1})
                    if (left.erase(moved(cell, a, up))) open.push_back(moved(cell, a, up));
        }
        if (!left.empty())
            throw parameter_error(sentence("The body falls apart: of its ", cells_.size(), " cells ", left.size(),
                                           " are not joined to the others by faces. Choose a smaller spacing, or "
                                           "make a body of each part."));
    }

    static Index moved(Index cell, std::size_t axis, std::int64_t steps) {
        cell[axis] += steps;
        return cell;
    }
    /// Returns the lattice index of a corner of a cell. Bit a of `corner` is 0 for the lower and 1 for the upper side
    /// along axis a.
    static Index corner_of(Index cell, std::uint32_t corner) {
        for (std::size_t a = 0; a < D; ++a) cell[a] += (corner >> a) & 1;
        return cell;
    }

private:
    template <class F>
    static void for_pairs_of_axes(const F& f) {
        for (std::size_t a = 0; a < D; ++a)
            for (std::size_t b = a + 1; b < D; ++b) f(a, b);
    }

    std::set<Index> cells_;
};

/// Returns the surface of a body of cells: the faces that belong to only one cell, as facets whose normals point
/// outwards.
/// \param cells     the cells of the body
/// \param place_of  place_of(node) returns the index of the point at the lattice node with the lattice index `node`
template <int D, class PlaceOf>
std::vector<Facet<D>> boundary_facets(const Cells<D>& cells, const PlaceOf& place_of) {
    using Index = typename Cells<D>::Index;
    std::vector<Facet<D>> facets;
    for (const auto& cell : cells.all()) {
        for (std::size_t a = 0; a < D; ++a) {
            for (const int up : {0, 1}) {
                if (cells.has(Cells<D>::moved(cell, a, up ? 1 : -1))) continue;
                const Index base = Cells<D>::moved(cell, a, up);
                const auto at = [&](int i, int j) {
                    Index node = base;
                    node[(a + 1) % D] += i;
                    if constexpr (D == 3) node[(a + 2) % D] += j;
                    return place_of(node);
                };
                if constexpr (D == 2) {
                    // For the upper face along x and the lower face along y, the outside is on the right-hand side if
                    // one goes from node 0 to node 1.
                    const bool onwards = (up == 1) == (a == 0);
                    facets.push_back({at(onwards ? 0 : 1, 0), at(onwards ? 1 : 0, 0)});
                } else {
                    std::array<std::uint32_t, 4> quad{at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
                    if (up == 0) std::swap(quad[1], quad[3]);
                    // Faces next to each other are cut along different diagonals, alternating like the colours of a
                    // chessboard.
                    if ((base[0] + base[1] + base[2] - base[a]) % 2 == 0)
                        facets.insert(facets.end(), {{quad[0], quad[1], quad[2]}, {quad[0], quad[2], quad[3]}});
                    else
                        facets.insert(facets.end(), {{quad[0], quad[1], quad[3]}, {quad[1], quad[2], quad[3]}});
                }
            }
        }
    }
    return facets;
}

}  // namespace detail

/// Builds a body of cubic cells (squares in 2D), one cell around each sample. To make the samples, fill a shape with
/// sample_box(), sample_sphere() or sample_mesh() and Pattern::lattice.
///
/// The points of the body are the corners of the cells, sorted so that the lattice index along the first axis changes
/// fastest. Stretch links are the edges of cells, shear links are the diagonals of faces and of cells, and bend links
/// join each point to its second neighbours along the axes. The body resists stretch, shear and bending. If the body is
/// compressed along one axis, it expands along the other axes.
///
/// The surface is closed. It consists of the faces that belong to only one cell; in 3D each face is cut into two
/// triangles. Where two cells touch only along an edge (in 2D: at a corner), one more cell is added beside them, so
/// that the body has no hinges.
/// \param samples  the centres of the cells, and the volume of one cell
/// \throws parameter_error  unless there are samples, all samples lie on one lattice, a cell of this lattice has the
///                          volume of a sample, no two samples lie at the same position, and all cells are connected by
///                          shared faces (in 2D: edges)
/// \throws memory_error     if the body does not fit into memory
template <int D>
[[nodiscard]] SoftBody<D> lattice_body(const Samples<D>& samples) {
    static_assert(D == 2 || D == 3);
    using Cells = detail::Cells<D>;
    if (samples.positions.empty())
        throw parameter_error("A soft body needs samples, but there are none. Fill a shape with samples.");
    detail::check_positive(samples.volume, "The volume of a sample", D == 3 ? "m^3" : "m^2");
    const double side = D == 2 ? std::sqrt(samples.volume) : std::cbrt(samples.volume);
    // The estimated memory per cell: one tree node here and one in check_connected(), the tree nodes of the corners,
    // and the links. Links that several cells share are stored more than once at first.
    constexpr double tree_node = 4 * sizeof(void*) + sizeof(typename Cells::Index) + sizeof(double);
    constexpr double links = Cells::corners * (Cells::corners - 1) / 2 + D * Cells::corners / 2;
    require_memory(double(samples.positions.size()) * (3 * tree_node + links * sizeof(Link)),
                   sentence("A soft body of ", samples.positions.size(), " cells"), "Fill it with a larger spacing.");
    Cells cells(samples, side);
    cells.fill_hinges();
    cells.check_connected();

    // Compares the indices along the last axis first. So in the sorted order, the index along the first axis changes
    // fastest.
    const auto by_last_axis = [](const auto& left, const auto& right) {
        return std::lexicographical_compare(left.rbegin(), left.rend(), right.rbegin(), right.rend());
    };
    std::map<typename Cells::Index, std::uint32_t, decltype(by_last_axis)> places(by_last_axis);
    for (const auto& cell : cells.all())
        for (std::uint32_t corner = 0; corner < Cells::corners; ++corner)
            places.emplace(Cells::corner_of(cell, corner), 0u);
    if (places.size() > max_points)
        throw parameter_error(sentence("The body has ", places.size(), " points; at most ", max_points,
                                       " are allowed. Choose a larger spacing."));

    SoftBody<D> body;
    Net<D>& net = body.net;
    for (auto& [node, place] : places) {
        place = std::uint32_t(net.positions.size());
        Vec<double, D> x = samples.positions.front();
        for (int a = 0; a < D; ++a) x[a] += (double(node[std::size_t(a)]) - 0.5) * side;
        net.positions.push_back(x);
    }
    const auto place_of = [&](const auto& node) { return places.at(node); };
    body.volumes.assign(net.positions.size(), 0.0);
    for (const auto& cell : cells.all()) {
        std::array<std::uint32_t, Cells::corners> at{};
        for (std::uint32_t corner = 0; corner < Cells::corners; ++corner) {
            at[corner] = place_of(Cells::corner_of(cell, corner));
            body.volumes[at[corner]] += samples.volume / Cells::corners;
        }
        for (std::uint32_t i = 0; i < Cells::corners; ++i)
            for (std::uint32_t j = i + 1; j < Cells::corners; ++j)
                net.links.push_back({at[i], at[j], std::has_single_bit(i ^ j) ? LinkKind::stretch : LinkKind::shear});
        for (std::size_t a = 0; a < D; ++a) {
            if (!cells.has(Cells::moved(cell, a, 1))) continue;
            for (std::uint32_t corner = 0; corner < Cells::corners; ++corner)
                if (((corner >> a) & 1) == 0)
                    net.links.push_back(
                        {at[corner], place_of(Cells::moved(Cells::corner_of(cell, corner), a, 2)), LinkKind::bend});
        }
    }
    net.links = detail::unique_links(std::move(net.links));
    net.facets = detail::boundary_facets<D>(cells, place_of);
    return body;
}

namespace detail {

/// Returns the index of the vertex that lies opposite to the vertex `from` along a ray through the inside of a mesh.
/// The ray is followed to the first triangle through which it leaves the mesh; of the corners of this triangle, the one
/// nearest to the intersection is returned. Method: Möller & Trumbore 1997, "Fast, minimum storage ray/triangle
/// intersection".
/// \param mesh   the closed mesh
/// \param from   index of the vertex at which the ray begins
/// \param along  direction of the ray, a unit vector
/// \param least  intersections nearer than this to the vertex `from` are ignored [m]
/// \param none   the value to return if the ray does not leave the mesh
inline std::uint32_t opposite_vertex(const TriangleMesh& mesh, std::uint32_t from, const Vec<double, 3>& along,
                                     double least, std::uint32_t none) {
    const auto& x = mesh.vertices[from];
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t found = none;
    for (const auto& triangle : mesh.triangles) {
        const auto& a = mesh.vertices[std::size_t(triangle[0])];
        const auto ab = mesh.vertices[std::size_t(triangle[1])] - a, ac = mesh.vertices[std::size_t(triangle[2])] - a;
        const auto p = cross(along, ac);
        const double det = dot(ab, p);
        if (!(det < 0)) continue;  // the ray enters the mesh through this triangle, or is parallel to it
        const auto s = x - a, q = cross(s, ab);
        const double u = dot(s, p) / det, v = dot(along, q) / det, t = dot(ac, q) / det;
        constexpr double over = -1e-9;  // tolerance below 0, so that no ray passes between two triangles
        if (!(u >= over && v >= over && u + v <= 1 - over && t > least && t < nearest)) continue;
        nearest = t;
        const double w = 1 - u - v;
        found = std::uint32_t(w >= u && w >= v ? triangle[0] : u >= v ? triangle[1] : triangle[2]);
    }
    return found;
}

/// Returns the outward unit normal at each vertex: the direction of the area-weighted mean of the normals of all
/// triangles at the vertex. If this mean is zero, the normal is the zero vector.
inline std::vector<Vec<double, 3>> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Vec<double, 3>> normals(mesh.vertices.size());
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto& corner = mesh.vertices[std::size_t(a)];
        const auto normal = cross(mesh.vertices[std::size_t(b)] - corner, mesh.vertices[std::size_t(c)] - corner);
        for (const auto index : {a, b, c}) normals[std::size_t(index)] += normal;
    }
    for (auto& normal : normals) {
        const double length = norm(normal);
        if (length > 0) normal = normal * (1 / length);
    }
    return normals;
}

}  // namespace detail

/// Builds a hollow body from a closed mesh. The surface gets stretch and bend links as in cloth(). Support links
/// through the inside keep the shape of the body.
///
/// Up to four support links join every vertex to the other side of the body: one in the direction opposite to the
/// vertex's normal, and three at 35° to this direction, 120° apart from each other. To find the other end of a link, a
/// ray is followed in the direction of the link to the triangle through which the ray leaves the mesh; the link ends at
/// the nearest corner of this triangle. The links opposite to the normal keep the thickness of the body, and the
/// inclined links resist shear. The body deforms under load and returns to its shape afterwards.
///
/// All points are vertices of the mesh, so there are fewer points than in lattice_body(). The part of the enclosed
/// volume that a point represents is proportional to the area of the facets at this point. The computing time is
/// proportional to the number of vertices times the number of triangles: less than a second for 1800 vertices and 3700
/// triangles.
///
/// Shells that face inwards although they bound no hole are reversed: see facing_outwards().
/// \throws mesh_error  if facing_outwards() or cloth() throws it
[[nodiscard]] inline SoftBody<3> mesh_body(const TriangleMesh& given) {
    const auto [mesh, volume, outwards] = detail::oriented(given);
    SoftBody<3> body{cloth(mesh), {}};
    Net<3>& net = body.net;
    const auto box = bounding_box(mesh);
    const double size = norm(box.upper - box.lower);

    const double slant = 35 * std::numbers::pi / 180;
    const auto normals = detail::vertex_normals(mesh);
    for (std::uint32_t i = 0; i < net.positions.size(); ++i) {
        const auto inwards = -normals[i];
        if (!(dot(inwards, inwards) > 0)) continue;
        const auto [u, v] = perpendicular(inwards);
        for (int ray = 0; ray < 4; ++ray) {
            const double turn = 2 * std::numbers::pi * ray / 3;
            const auto slanted =
                inwards * std::cos(slant) + (u * std::cos(turn) + v * std::sin(turn)) * std::sin(slant);
            const auto opposite = detail::opposite_vertex(mesh, i, ray == 3 ? inwards : slanted, 1e-6 * size, i);
            if (opposite == i) continue;
            const Link link{i, opposite, LinkKind::support};
            if (rest_length(net, link) > 1e-6 * size) net.links.push_back(link);
        }
    }
    net.links = detail::unique_links(std::move(net.links));
    double area = 0;
    for (const auto& facet : net.facets) area += facet_area(net, facet);
    body.volumes = facet_masses(net, volume / area);
    return body;
}

}  // namespace firn::inline FIRN_BUILD
