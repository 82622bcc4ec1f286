/// \file The normal and the gap between two contact groups at a node, from the positions of the particles around it.
///
/// All sums over particles are taken in one order: by base node, then by id, in eight lanes. So the results depend
/// neither on the order of the particles in memory nor on the width of the SIMD registers.
#pragma once

#include <firn/contact/concept.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/loops/around_node.hpp>
#include <firn/math/exp_log.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Solves A x = b for a symmetric positive definite N × N matrix, by Cholesky's method.
/// \param A  the matrix; destroyed. Only the lower triangle is read
/// \param b  the right side; receives the solution
/// \return whether the matrix was positive definite
template <int N>
FIRN_INLINE bool solve_definite(double (&A)[N][N], double (&b)[N]) {
    double per_pivot[N];
    for (int j = 0; j < N; ++j) {
        for (int k = 0; k < j; ++k) A[j][j] -= A[j][k] * A[j][k] * per_pivot[k];
        if (!(A[j][j] > 0)) return false;
        per_pivot[j] = 1 / A[j][j];
        for (int i = j + 1; i < N; ++i)
            for (int k = 0; k < j; ++k) A[i][j] -= A[i][k] * A[j][k] * per_pivot[k];
    }
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < i; ++k) b[i] -= A[i][k] * b[k] * per_pivot[k];
    for (int i = N - 1; i >= 0; --i) {
        for (int k = i + 1; k < N; ++k) b[i] -= A[k][i] * b[k];
        b[i] *= per_pivot[i];
    }
    return true;
}

}  // namespace detail

/// The surface between two contact groups at a node.
template <int D>
struct Separation {
    Vec<double, D> normal{};  ///< unit normal; it points from the second group into the first
    double gap = 0;           ///< distance between the groups along the normal [cells]; negative if they overlap
    bool may_touch = false;   ///< false if the groups are so far apart that they cannot touch in this step
};

/// Finds the surface between two contact groups at a node by logistic regression: the plane β · x + b = 0 that
/// minimises
///
///     ½ (mean of log(1 + e⁻ᶻ) over the first group + mean of log(1 + eᶻ) over the second) + ½ λ ‖β‖²,   z = β · x + b
///
/// over the particles that contribute to the node. The normal is n = β/‖β‖. The sum is convex. Newton's method starts
/// from β = 0, where it gives Fisher's linear discriminant; its further steps begin with ‖β‖ = sharpness and half-way
/// between the groups. Then, with the radius r = ½ (J V0)^(1/D) of a particle,
///
///     gap = min over the first group of (n · x − r + ½ κ m)  −  max over the second of (n · x + r − ½ κ m),
///     m = max(l² − (D−1) (flat r)², 0)
///
/// l is the distance of the particle from the line through the node along n. The term ½ κ m makes the gap local:
/// without it, the particles that protrude most decide, up to 1.5 cells beside the node. Where round bodies meet, these
/// are the particles nearer to the middle of the contact, so a node at its edge would bear load too early. On its own
/// extent, and a tenth beyond, a particle is flat.
///
/// If the gap along the normal of one group's own surface is wider, that normal is taken.
///
/// Nairn, Hammerquist and Smith 2020 find the plane in a similar way, by least squares of the logistic function.
/// \tparam Kernel  decides which particles contribute to a node
template <class Kernel, int D>
class Separator {
    using Near = detail::AroundNode<Kernel, D>;
    using P = detail::Eight;
    static constexpr int N = D + 1;

public:
    /// The weight λ of the penalty. With it, the layer of particles at the surface decides about the plane.
    static constexpr double penalty = 5e-5;
    /// What the extent of the particles themselves adds to their scatter at the start: ¼ r²/3 with r = ¼ cell [cells²].
    /// Without it, a node that sees a single row of particles of each group would find a plane along the row.
    static constexpr double own_scatter = 5e-3;
    static constexpr double sharpness = 16;  ///< ‖β‖ after the start [1/cell]
    static constexpr int newton_steps = 4;   ///< Largest number of Newton steps after the start.
    /// The search ends with a Newton step shorter than this [1/cell]. It turns the normal by less than 3°.
    static constexpr double settled = 0.8;
    static constexpr double band = 0.6;  ///< Newton's method needs the particles this near to the plane [cells].

    /// κ: beyond its own extent a particle counts as a paraboloid of this curvature [1/cell]. A particle 1.5 cells
    /// beside the node lies deeper by 0.22 cells.
    static constexpr double bulge = 0.2;
    /// A particle is flat up to this part of its radius beside its middle, along each axis of the surface.
    static constexpr double flat = 1.1;
    /// The normal of one group's own surface is taken if the gap along it, with κ = 0, is wider by this [cells].
    static constexpr double own_advantage = 0.008;

    /// Returns the surface between two groups at a node.
    ///
    /// A plane that separates the groups before and after a step shows that they do not touch in it, whatever the best
    /// plane is. So the plane at the start often suffices.
    /// \param first  the particles of the first group around the node;  \param second  those of the second group
    /// \param moved  how far the first group moves relative to the second in the step [cells]
    /// \param reach  the gap up to which the contact law acts on groups that do not approach [cells]
    /// \param near   the normal found at a node nearby, from which the search starts; zero if there is none
    Separation<D> operator()(const Near& first, const Near& second, const Vec<double, D>& moved, double reach,
                             ContactNormals how, const Vec<double, D>& near) {
        if (first.size() == 0 || second.size() == 0) return {};
        const Near* const groups[2] = {&first, &second};
        const bool by_regression = how == ContactNormals::regression;
        Separation<D> found;
        if (!by_regression)
            found.normal = unit(inward(first) - inward(second));
        else
            found.normal = dot(near, near) > 0 ? near : discriminant(groups);
        if (!(dot(found.normal, found.normal) > 0)) return {};
        Depths low = depths(first, found.normal), high = depths(second, -found.normal);
        const auto may_touch = [&] {
            found.gap = low.beside + high.beside;
            return found.may_touch = !(found.gap > reach && found.gap + dot(moved, found.normal) > 0);
        };
        if (!may_touch() || !by_regression) return found;
        found.normal = regression(groups, found.normal, 0.5 * (low.beside - high.beside));
        // Where the corner of one body stands on the flat face of another, the plane of the regression leans.
        std::array<Vec<double, D>, 3> normals{found.normal, inward(first), -inward(second)}, opposite;
        for (int k = 0; k < 3; ++k) {
            if (!(dot(normals[k], normals[0]) > 0)) normals[k] = normals[0];
            opposite[k] = -normals[k];
        }
        const auto of_first = depths(first, normals), of_second = depths(second, opposite);
        double widest = 0;
        for (int k = 0; k < 3; ++k) {
            const double width = of_first[k].flat + of_second[k].flat;
            if (k > 0 && !(width > widest)) continue;
            widest = k > 0 ? width : width + own_advantage;
            found.normal = normals[k];
            low = of_first[k], high = of_second[k];
            if (!may_touch()) break;
        }
        return found;
    }

    /// Returns the smallest n · x − r + ½ κ m of the particles [cells], with x counted from the node.
    /// \param n  a unit vector
    static double depth(const Near& group, const Vec<double, D>& n) { return depths(group, n).beside; }

private:
    detail::ParticleRows<D> near_plane_[2];  // the particles that Newton's method needs

    static Vec<double, D> unit(const Vec<double, D>& v) {
        const double square = dot(v, v);
        return square > 0 && square < std::numeric_limits<double>::infinity() ? v * (1 / std::sqrt(square))
                                                                              : Vec<double, D>::zero();
    }

    /// Returns the normal after the first Newton step, from β = 0.
    static Vec<double, D> discriminant(const Near* const (&groups)[2]) {
        const double theta[N] = {};
        return unit(newton_step<true>(groups, theta, own_scatter).normal);
    }

    /// Returns the direction in which the volume of a group grows at the node.
    static Vec<double, D> inward(const Near& group) {
        constexpr int K = Kernel::support;
        P sums[D];
        for (P& sum : sums) sum = P(0.f);
        group.for_eights([&](const P(&x)[D], const P& radius, const P::mask& valid) FIRN_LAMBDA {
            P weight[D], slope[D], volume = select(valid, P(1.f), P(0.f));
            for (int a = 0; a < D; ++a) {
                const P base = base_node<Kernel>(x[a]);
                const auto weights = Kernel::weights(x[a] - base), slopes = Kernel::gradients(x[a] - base);
                weight[a] = weights[0], slope[a] = slopes[0];
                for (int k = 1; k < K; ++k) {  // the node is number −base from the base node
                    const auto farther = base < P(0.5f - float(k));
                    weight[a] = select(farther, weights[std::size_t(k)], weight[a]);
                    slope[a] = select(farther, slopes[std::size_t(k)], slope[a]);
                }
                volume = volume * radius;
            }
            for (int a = 0; a < D; ++a) {
                P term = volume * slope[a];
                for (int c = 0; c < D; ++c)
                    if (c != a) term = term * weight[c];
                sums[a] = sums[a] - term;
            }
        });
        Vec<double, D> direction;
        for (int a = 0; a < D; ++a) direction[a] = double(detail::sum_of_lanes(sums[a]));
        return unit(direction);
    }

    /// The smallest n · x − r + ½ κ m of particles, with κ = 0 and with κ = `bulge` [cells].
    struct Depths {
        double flat, beside;
    };
    static Depths depths(const Near& group, const Vec<double, D>& n) { return depths(group, std::array{n})[0]; }
    /// Returns this for several normals.
    template <std::size_t count>
    static std::array<Depths, count> depths(const Near& group, const std::array<Vec<double, D>, count>& normals) {
        const P far(std::numeric_limits<float>::max());
        P normal[count][D], flattest[count], least[count];
        for (std::size_t k = 0; k < count; ++k) {
            for (int a = 0; a < D; ++a) normal[k][a] = P(float(normals[k][a]));
            flattest[k] = least[k] = far;
        }
        group.for_eights([&](const P(&x)[D], const P& radius, const P::mask& valid) FIRN_LAMBDA {
            P square(0);
            for (int a = 0; a < D; ++a) square = square + x[a] * x[a];
            square = square - P(float(flat * flat * (D - 1))) * radius * radius;
            for (std::size_t k = 0; k < count; ++k) {
                P along(0);
                for (int a = 0; a < D; ++a) along = along + x[a] * normal[k][a];
                const P beside = max(square - along * along, P(0.f));
                const P depth = select(valid, along - radius, far);
                flattest[k] = min(flattest[k], depth);
                least[k] = min(least[k], depth + beside * P(float(0.5 * bulge)));
            }
        });
        std::array<Depths, count> all;
        for (std::size_t k = 0; k < count; ++k)
            all[k] = {-double(reduce_max(-flattest[k])), -double(reduce_max(-least[k]))};
        return all;
    }

    /// Collects the particles of a group near a plane: those of the base nodes whose cells are near it.
    /// \param n  unit normal of the plane;  \param middle  n · x of the plane, counted from the node [cells]
    static Near near_plane(const Near& group, const Vec<double, D>& n, double middle, detail::ParticleRows<D>& rows) {
        double within = band;
        for (int a = 0; a < D; ++a) within += 0.5 * std::abs(n[a]);
        rows.reserve(group.size());
        group.for_runs_near(n, middle, within, [&](std::uint32_t begin, std::uint32_t end) {
            rows.add(group.row(0), group.apart(), begin, end);
        });
        Near near(rows, group.shift());
        near.add(0, rows.size());
        return near;
    }

    /// Returns the normal of the plane after Newton's method.
    /// \param start   the normal at the start;  \param middle  n · x of the plane at the start, counted from the node
    Vec<double, D> regression(const Near* const (&groups)[2], const Vec<double, D>& start, double middle) {
        const Near first = near_plane(*groups[0], start, middle, near_plane_[0]);
        const Near second = near_plane(*groups[1], start, middle, near_plane_[1]);
        if (first.size() == 0 || second.size() == 0) return start;
        const Near* const near[2] = {&first, &second};
        double theta[N];
        for (int a = 0; a < D; ++a) theta[a] = sharpness * start[a];
        theta[D] = -sharpness * middle;
        for (int step = 0; step < newton_steps; ++step) {
            const Step to = newton_step(near, theta, penalty);
            const double square = dot(to.normal, to.normal) + to.offset * to.offset, most = 0.5 * sharpness;
            const double part = square > most * most ? most / std::sqrt(square) : 1.0;
            for (int a = 0; a < D; ++a) theta[a] += part * to.normal[a];
            theta[D] += part * to.offset;
            if (square < settled * settled) break;
        }
        Vec<double, D> normal;
        for (int a = 0; a < D; ++a) normal[a] = theta[a];
        normal = unit(normal);
        return dot(normal, start) > 0 ? normal : start;
    }

    /// The change of β and b in a Newton step.
    struct Step {
        Vec<double, D> normal;
        double offset;
    };
    /// Returns a Newton step from β and b, which are `theta`; zero if the matrix is singular.
    /// \param weight  the weight λ of the penalty
    template <bool from_zero = false>
    static Step newton_step(const Near* const (&groups)[2], const double (&theta)[N], double weight) {
        double H[N][N], to[N];
        sum_terms<from_zero>(groups, theta, H, to);
        for (int a = 0; a < D; ++a) {
            H[a][a] += weight;
            to[a] -= weight * theta[a];
        }
        Step step{Vec<double, D>::zero(), 0};
        if (!detail::solve_definite(H, to)) return step;
        for (int a = 0; a < D; ++a) step.normal[a] = to[a];
        step.offset = to[D];
        return step;
    }

    /// Sums the terms of the particles in the matrix and the right side of a Newton step.
    /// \tparam from_zero  whether β and b are 0
    template <bool from_zero>
    static void sum_terms(const Near* const (&groups)[2], const double (&theta)[N], double (&H)[N][N],
                          double (&to)[N]) {
        P sums[N * (N + 1) / 2], rest[N], beta[N];
        for (P& sum : sums) sum = P(0);
        for (P& sum : rest) sum = P(0);
        for (int a = 0; a < N; ++a) beta[a] = P(float(theta[a]));
        for (int g = 0; g < 2; ++g) {
            const Near& group = *groups[g];
            const P sign(g == 0 ? 1.f : -1.f), weight{float(0.5 / group.size())};
            group.for_eights([&](const P(&place)[D], const P&, const P::mask& valid) FIRN_LAMBDA {
                P x[N], wrong(0.5f);
                for (int a = 0; a < D; ++a) x[a] = place[a];
                x[D] = P(1.f);
                // The probability of the wrong group: 1/(1 + e^z) for the first group, 1/(1 + e^−z) for the second.
                if constexpr (!from_zero) {
                    P z = beta[D];
                    for (int a = 0; a < D; ++a) z = z + x[a] * beta[a];
                    wrong = P(1.f) / (P(1.f) + exp(max(min(z * sign, P(80.f)), P(-80.f))));
                }
                const P mine = select(valid, weight * wrong, P(0.f));
                const P curvature = mine * (P(1.f) - wrong), pull = mine * sign;
                int k = 0;
                unroll<N>([&](auto a) FIRN_LAMBDA {
                    rest[a] = rest[a] + pull * x[a];
                    const P part = curvature * x[a];
                    unroll<a + 1>([&](auto c) FIRN_LAMBDA {
                        sums[k] = sums[k] + part * x[c];
                        ++k;
                    });
                });
            });
        }
        int k = 0;
        for (int a = 0; a < N; ++a) {
            to[a] = double(detail::sum_of_lanes(rest[a]));
            for (int c = 0; c <= a; ++c) H[a][c] = double(detail::sum_of_lanes(sums[k++]));
        }
    }
};

}  // namespace firn::inline FIRN_BUILD
