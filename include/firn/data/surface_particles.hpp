/// \file Particles in boxes, and the ellipsoid of each particle: the first half of firn/data/surface.hpp.
#pragma once

#include <firn/core/pack.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/memory.hpp>
#include <firn/data/surface_options.hpp>
#include <firn/math/inverse.hpp>
#include <firn/math/principal_axes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

namespace firn::inline FIRN_BUILD::detail {

/// A box of an infinite lattice of boxes.
using BoxIndex = std::array<std::int64_t, 3>;

/// Numbers the boxes of a lattice that begins at a box `origin`: 21 bits for each axis.
struct BoxKeys {
    static constexpr std::int64_t most = std::int64_t(1) << 21;  ///< number of boxes along an axis
    BoxIndex origin{};

    std::uint64_t operator()(const BoxIndex& at) const {
        std::uint64_t key = 0;
        for (std::size_t a = 3; a-- > 0;) key = key << 21 | std::uint64_t(at[a] - origin[a]);
        return key;
    }
    BoxIndex box(std::uint64_t key) const {
        BoxIndex at;
        for (std::size_t a = 0; a < 3; ++a) at[a] = std::int64_t(key >> 21 * a & (most - 1)) + origin[a];
        return at;
    }
};

/// Items, sorted by boxes.
struct Boxes {
    BoxKeys keys;
    std::vector<std::uint64_t> key;  ///< of each box that has items, in ascending order
    std::vector<std::uint32_t>
        first;  ///< for each box, the place of its first item in `order`; and the number of items
    std::vector<std::uint32_t> order;  ///< the items, box by box

    std::size_t size() const { return key.size(); }
    /// Returns the index of a box, or size() if it has no items.
    std::size_t find(const BoxIndex& at) const {
        for (std::size_t a = 0; a < 3; ++a)
            if (at[a] < keys.origin[a] || at[a] - keys.origin[a] >= BoxKeys::most) return size();
        const auto found = std::lower_bound(key.begin(), key.end(), keys(at));
        return found != key.end() && *found == keys(at) ? std::size_t(found - key.begin()) : size();
    }
};

/// Sorts points by cubic boxes of a lattice through the origin. Points of one box keep the order of `order`.
/// \param order  the points in this order
/// \throws parameter_error  if the boxes are more than can be numbered along an axis
inline Boxes boxes_of(std::span<const Vec<double, 3>> x, std::vector<std::uint32_t> order, double side, int threads) {
    const auto box = [&](std::uint32_t k) {
        BoxIndex at;
        for (int a = 0; a < 3; ++a) at[std::size_t(a)] = std::int64_t(std::floor(x[k][a] / side));
        return at;
    };
    Boxes boxes;
    Vec<double, 3> low = x[0], high = x[0];
    for (const auto& each : x)
        for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], each[a]), high[a] = std::max(high[a], each[a]);
    for (int a = 0; a < 3; ++a) {
        // Two boxes of room, since what surrounds the points is numbered, too.
        if (!(std::max(std::abs(low[a]), std::abs(high[a])) < 1e15 * side) ||
            !((high[a] - low[a]) / side < double(BoxKeys::most / 2)))
            throw parameter_error(sentence("The particles lie from ", low[a], " m to ", high[a], " m along axis ", a,
                                           ", too far apart for a surface of this fineness. Take out those that have "
                                           "flown away, or give a larger cell_size or larger volumes."));
        boxes.keys.origin[std::size_t(a)] = std::int64_t(std::floor(low[a] / side)) - (std::int64_t(1) << 18);
    }
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed(order.size());  // with the place in `order`
    for_chunks(order.size(), threads, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) keyed[i] = {boxes.keys(box(order[i])), std::uint32_t(i)};
    });
    std::sort(keyed.begin(), keyed.end());
    boxes.order.resize(order.size());
    for (std::size_t i = 0; i < keyed.size(); ++i) {
        if (i == 0 || keyed[i].first != keyed[i - 1].first) {
            boxes.key.push_back(keyed[i].first);
            boxes.first.push_back(std::uint32_t(i));
        }
        boxes.order[i] = order[keyed[i].second];
    }
    boxes.first.push_back(std::uint32_t(keyed.size()));
    return boxes;
}

/// The kernel of a particle: c V/√det B (1 − dᵀ B⁻¹ d)³ within the ellipsoid dᵀ B⁻¹ d < 1, whose integral is V.
struct Ellipsoid {
    Vec<double, 3> centre;        ///< [m]
    std::array<double, 6> shape;  ///< B [m²]: xx, xy, xz, yy, yz, zz
    double volume;                ///< V [m³]; 0: the particle is left out
};

/// c of the kernel: one over the integral of (1 − r²)³ over the unit ball.
inline constexpr double kernel_constant = 315 / (64 * 3.14159265358979323846);

/// The variance of the particles around one in matter, along any axis, weighted by the kernel [square of its radius].
inline constexpr double variance_in_matter = 1. / 11;

/// Value of the field of balls on a line of particles where nothing else is. \param radius  of the balls [spacings]
inline double on_a_line(double radius) { return kernel_constant * (32. / 35) / (radius * radius); }

/// Returns F without extreme stretches: at equal volume no axis is longer or shorter by more than a factor, and the
/// volume changes at most by this factor.
inline Mat<double, 3> believed(const Mat<double, 3>& F, double most) {
    auto parts = svd(F);
    auto& s = parts.values;
    for (double& stretch : s.v) stretch = std::max(std::abs(stretch), 1e-6);
    const double now = s[0] * s[1] * s[2], root = std::cbrt(now);
    for (double& stretch : s.v) stretch = std::clamp(stretch / root, 1 / most, most);
    s = s * std::cbrt(std::clamp(now, 1 / most, most) / (s[0] * s[1] * s[2]));
    for (int i = 0; i < 3; ++i)
        for (int a = 0; a < 3; ++a) parts.U(i, a) *= s[a];
    return parts.U * transpose(parts.V);
}

/// The particles around one, in undeformed matter and relative to the radius of the kernel.
struct Moments {
    double sum = 0;               ///< of their volumes, each weighted by the kernel [m³]
    Mat<double, 3> covariance{};  ///< of their places
};

/// The particles near a box, relative to its corner, lane by lane.
class Neighbourhood {
public:
    static constexpr std::size_t lanes = 16;
    using Lanes = pack<float, int(lanes)>;

    /// Forgets all particles. \param most  how many will be added
    void clear(std::size_t most) {
        used_ = 0;
        for (auto* list : {&x_, &y_, &z_, &volume_}) list->resize(std::max(list->size(), most + lanes));
    }
    void add(const Vec<double, 3>& x, double volume) {
        x_[used_] = float(x[0]), y_[used_] = float(x[1]), z_[used_] = float(x[2]);
        volume_[used_++] = float(volume);
    }
    /// Fills the last pack with particles of volume 0.
    void complete() {
        while (used_ % lanes != 0) add({}, 0);
    }
    /// Returns the moments around x. \param to_ball  makes a ball of radius 1 of what counts as near
    Moments around(const Vec<double, 3>& x, const Mat<double, 3>& to_ball) const {
        const Lanes x0 = float(x[0]), y0 = float(x[1]), z0 = float(x[2]);
        std::array<Lanes, 9> M;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) M[std::size_t(3 * i + j)] = float(to_ball(i, j));
        std::array<Lanes, 10> sum;
        sum.fill(Lanes(0.0F));
        for (std::size_t k = 0; k < used_; k += lanes) {
            const Lanes x1 = Lanes::load(&x_[k]) - x0, y1 = Lanes::load(&y_[k]) - y0, z1 = Lanes::load(&z_[k]) - z0;
            const Lanes dx = M[0] * x1 + M[1] * y1 + M[2] * z1, dy = M[3] * x1 + M[4] * y1 + M[5] * z1,
                        dz = M[6] * x1 + M[7] * y1 + M[8] * z1;
            const Lanes rest = max(Lanes(0.0F), Lanes(1.0F) - (dx * dx + dy * dy + dz * dz));
            const Lanes w = rest * rest * rest * Lanes::load(&volume_[k]);
            const Lanes wx = w * dx, wy = w * dy, wz = w * dz;
            sum[0] += w;
            sum[1] += wx, sum[2] += wy, sum[3] += wz;
            sum[4] += wx * dx, sum[5] += wx * dy, sum[6] += wx * dz;
            sum[7] += wy * dy, sum[8] += wy * dz, sum[9] += wz * dz;
        }
        std::array<double, 10> total{};
        for (std::size_t k = 0; k < total.size(); ++k)
            for (int l = 0; l < int(lanes); ++l) total[k] += double(sum[k][l]);
        const double one = total[0];  // at least the particle itself
        Moments result;
        result.sum = one;
        const auto m = Vec<double, 3>{total[1], total[2], total[3]} * (1 / one);
        const auto second = [&](std::size_t k, int i, int j) {
            result.covariance(i, j) = result.covariance(j, i) = total[k] / one - m[i] * m[j];
        };
        second(4, 0, 0), second(5, 0, 1), second(6, 0, 2), second(7, 1, 1), second(8, 1, 2), second(9, 2, 2);
        return result;
    }

private:
    std::vector<float> x_, y_, z_, volume_;
    std::size_t used_ = 0;
};

/// The ellipsoids of particles, in an order that depends on the particles alone, and the particles without neighbours.
struct Ellipsoids {
    std::vector<Ellipsoid> all;
    std::vector<std::uint32_t> particle;  ///< of each ellipsoid, its index in the input
    std::vector<std::uint32_t> alone;     ///< indices in the input, in ascending order
};

/// Returns whether one particle comes before another that lies in the same box: by all that it has.
inline bool comes_before(const SurfaceParticles& given, std::uint32_t a, std::uint32_t b) {
    const auto order = [](const double* x, const double* y, std::size_t n) {
        for (std::size_t k = 0; k < n; ++k)
            if (x[k] != y[k]) return x[k] < y[k] ? -1 : 1;
        return 0;
    };
    int result = order(given.positions[a].v, given.positions[b].v, 3);
    if (result == 0 && given.volumes.size() > 1) result = order(&given.volumes[a], &given.volumes[b], 1);
    if (result == 0 && !given.deformation_gradients.empty())
        result = order(given.deformation_gradients[a].m, given.deformation_gradients[b].m, 9);
    for (const auto& field : given.fields) {
        const auto n = std::size_t(field.components);
        if (result == 0) result = order(field.values.data() + n * a, field.values.data() + n * b, n);
    }
    return result != 0 ? result < 0 : a < b;
}

/// Returns the inverse of a matrix whose determinant is not 0.
inline Mat<double, 3> inverted(const Mat<double, 3>& A) { return transpose(inverse_transposed(A)); }

/// Returns the ellipsoids of particles. \see firn/data/surface.hpp
inline Ellipsoids ellipsoids_of(const SurfaceParticles& given, const SurfaceOptions& options) {
    using Matrix = Mat<double, 3>;
    const std::size_t n = given.positions.size();
    const bool has_F = !given.deformation_gradients.empty();
    const auto spacing_of = [&](std::size_t k) { return std::cbrt(given.volumes[given.volumes.size() == 1 ? 0 : k]); };
    const int workers = thread_count(options.threads);
    std::vector<double> volume(n), reach(n);
    std::vector<Matrix> deformed(has_F ? n : 0);
    for_chunks(n, options.threads, [&](std::size_t from, std::size_t to) {
        for (std::size_t k = from; k < to; ++k) {
            const double spacing = spacing_of(k);
            volume[k] = spacing * spacing * spacing;
            reach[k] = options.radius * spacing;
            if (!has_F) continue;
            const Matrix F = believed(given.deformation_gradients[k], options.largest_stretch);
            deformed[k] = F;
            volume[k] *= std::abs(determinant(F));
            double longest = 0;
            for (int i = 0; i < 3; ++i) longest = std::max(longest, norm(Vec<double, 3>{F(i, 0), F(i, 1), F(i, 2)}));
            reach[k] *= longest;
        }
    });
    const double side = *std::max_element(reach.begin(), reach.end());
    std::vector<std::uint32_t> any_order(n);
    std::iota(any_order.begin(), any_order.end(), 0U);
    Boxes boxes = boxes_of(given.positions, std::move(any_order), side, options.threads);
    parallel_for(boxes.size(), workers, [&](std::size_t b, int) {
        std::sort(boxes.order.begin() + boxes.first[b], boxes.order.begin() + boxes.first[b + 1],
                  [&](std::uint32_t i, std::uint32_t j) { return comes_before(given, i, j); });
    });

    Ellipsoids result;
    result.all.resize(n);
    result.particle = boxes.order;
    std::vector<char> is_alone(n);
    std::vector<Neighbourhood> of_worker(std::size_t(std::max(workers, 1)));
    const double little = 0.9 * on_a_line(options.radius), least = options.least_radius / options.radius;
    parallel_for(boxes.size(), workers, [&](std::size_t b, int worker) {
        Neighbourhood& near = of_worker[std::size_t(worker)];
        const BoxIndex at = boxes.keys.box(boxes.key[b]);
        Vec<double, 3> corner{};
        for (int a = 0; a < 3; ++a) corner[a] = double(at[std::size_t(a)]) * side;
        std::array<std::size_t, 27> around;
        std::size_t most = 0;
        for (int k = 0; k < 27; ++k) {
            const std::size_t other = boxes.find({at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1});
            around[std::size_t(k)] = other;
            if (other < boxes.size()) most += boxes.first[other + 1] - boxes.first[other];
        }
        near.clear(most);
        for (const std::size_t other : around) {
            if (other == boxes.size()) continue;
            for (std::uint32_t i = boxes.first[other]; i < boxes.first[other + 1]; ++i)
                near.add(given.positions[boxes.order[i]] - corner, volume[boxes.order[i]]);
        }
        near.complete();
        for (std::uint32_t i = boxes.first[b]; i < boxes.first[b + 1]; ++i) {
            const std::uint32_t k = boxes.order[i];
            const double radius = options.radius * spacing_of(k);
            Matrix from_ball = Matrix::identity() * radius;
            if (has_F) from_ball = deformed[k] * radius;
            const Moments moments = near.around(given.positions[k] - corner, inverted(from_ball));
            auto axes = principal_axes(moments.covariance);
            // The squares of the axes. A flat one is less flat than in the paper, since few particles tell it roughly.
            const double longest = axes.values[0];
            for (double& axis : axes.values.v) {
                const double variance = std::sqrt(std::max(axis, 0.0) * longest);
                axis = std::clamp(variance / variance_in_matter, least * least, 1.0);
            }
            const Matrix B = from_ball * spectral(axes.directions, axes.values) * transpose(from_ball);
            is_alone[k] = kernel_constant * moments.sum < little * std::abs(determinant(from_ball));
            result.all[i] = {given.positions[k],
                             {B(0, 0), B(0, 1), B(0, 2), B(1, 1), B(1, 2), B(2, 2)},
                             is_alone[k] && !options.separate ? 0 : volume[k]};
        }
    });
    for (std::uint32_t k = 0; k < n; ++k)
        if (is_alone[k]) result.alone.push_back(k);
    return result;
}

}  // namespace firn::inline FIRN_BUILD::detail
