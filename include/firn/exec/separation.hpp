/// \file The normal and the gap between two contact groups at a node, from the positions of the particles around it.
///
/// All sums over particles are taken in one order: by base node, then by id, in eight lanes. So the results depend
/// neither on the order of the particles in memory nor on the width of the SIMD registers.
#pragma once

#include <firn/contact/concept.hpp>
#include <firn/core/pack.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/math/exp_log.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace firn {

namespace detail {

/// Eight numbers that are processed together; where registers are shorter, in several of them.
using Eight = pack<float, 8>;

/// Returns the sum of all lanes, added up as a balanced tree.
FIRN_INLINE float sum_of_lanes(const Eight& all) {
    using four [[gnu::vector_size(16)]] = float;
    four halves[2];
    std::memcpy(halves, &all.lanes, sizeof halves);
    const four half = halves[0] + halves[1];
    return (half[0] + half[2]) + (half[1] + half[3]);
}
/// Returns a mask of the first `count` lanes.
FIRN_INLINE Eight::mask first_lanes(std::uint32_t count) {
    alignas(32) static constexpr std::int32_t numbers[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    Eight::mask_vector lanes;
    std::memcpy(&lanes, numbers, sizeof lanes);
    return {lanes < std::int32_t(std::min<std::uint32_t>(count, 8))};
}

/// The particles of one contact group around the nodes of a block, sorted by their base nodes, then by id.
template <class Kernel, int D>
class NearParticles {
public:
    static constexpr int K = Kernel::support;
    static constexpr int lines = D == 2 ? K : K * K;  ///< Number of lines of base nodes whose particles reach a node.
    static constexpr std::size_t spare = 8;           ///< Number of values that may be read behind the last particle.

    /// A particle. Positions are counted from the lower corner of the block of nodes [cells].
    struct Particle {
        std::uint32_t id, bin;
        float place[D];  ///< position [cells]
        float radius;    ///< half of the particle's extent [cells]
    };
    /// Consecutive particles: those with the indices begin ≤ i < end.
    struct Span {
        std::uint32_t begin, end;
    };
    using Spans = std::array<Span, std::size_t(lines)>;

    std::vector<Particle> found;  ///< The particles, in any order, until sort() is called.

    /// Prepares for particles that reach the nodes low to high (along each axis, counted from the block's first node).
    void clear(const int (&low)[D], const int (&high)[D]) {
        found.clear();
        std::size_t bins = 1;
        for (int a = 0; a < D; ++a) {
            first_[a] = low[a] - (K - 1);
            count_[a] = high[a] - first_[a] + 1;
            bins *= std::size_t(count_[a]);
        }
        begin_.assign(bins + 1, 0);
    }
    int first(int axis) const { return first_[axis]; }                    ///< Lowest base node that reaches a node.
    int last(int axis) const { return first_[axis] + count_[axis] - 1; }  ///< Highest base node that reaches a node.
    int bins(int axis) const { return count_[axis]; }                     ///< Number of base nodes along an axis.

    /// Sorts the particles.
    void sort() {
        for (const Particle& p : found) ++begin_[p.bin + 1];
        for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
        next_.assign(begin_.begin(), begin_.end());
        if (order_.size() < found.size()) order_.resize(found.size());
        for (std::uint32_t i = 0; i < found.size(); ++i) {
            const std::uint32_t first = begin_[found[i].bin];
            std::uint32_t at = next_[found[i].bin]++;
            for (; at > first && found[order_[at - 1]].id > found[i].id; --at) order_[at] = order_[at - 1];
            order_[at] = i;
        }
        for (auto& numbers : place_)
            if (numbers.size() < found.size() + spare) numbers.resize(found.size() + spare);
        if (radius_.size() < found.size() + spare) radius_.resize(found.size() + spare);
        for (std::size_t i = 0; i < found.size(); ++i) {
            const Particle& p = found[order_[i]];
            for (int a = 0; a < D; ++a) place_[std::size_t(a)][i] = p.place[a];
            radius_[i] = p.radius;
        }
    }

    /// Returns the particles that contribute to a node.
    Spans around(const int (&node)[D]) const {
        Spans spans;
        for (int line = 0; line < lines; ++line) {
            const std::size_t b = first_bin(node, line);
            spans[std::size_t(line)] = {begin_[b], begin_[b + K]};
        }
        return spans;
    }
    /// Returns the particles around a node whose base nodes have cells near a plane: the distance of a cell's middle is
    /// at most `within` [cells].
    /// \param n  unit normal of the plane;  \param middle  n · x of the plane, counted from the node [cells]
    Spans near_plane(const int (&node)[D], const Vec<double, D>& n, double middle, double within) const {
        Spans spans;
        for (int line = 0; line < lines; ++line) {
            const std::size_t b = first_bin(node, line);
            double along = -middle;
            for (int a = 0; a < D; ++a) along += n[a] * (place_of_line(line, a) - (K - 1) + Kernel::base_shift + 0.5);
            int begin = K, end = 0;
            for (int k = 0; k < K; ++k)
                if (std::abs(along + n[D - 1] * k) <= within) {
                    begin = std::min(begin, k);
                    end = k + 1;
                }
            if (begin > end) begin = end;
            spans[std::size_t(line)] = {begin_[b + std::size_t(begin)], begin_[b + std::size_t(end)]};
        }
        return spans;
    }

    /// Returns the particles of one of the base nodes whose particles reach a node.
    /// \param bin  number of the base node, from 0 to lines × K − 1
    Span bin_around(const int (&node)[D], int bin) const {
        const std::size_t b = first_bin(node, bin / K) + std::size_t(bin % K);
        return {begin_[b], begin_[b + 1]};
    }
    /// Returns where the node lies, counted from that base node.
    static std::array<int, std::size_t(D)> node_of_bin(int bin) {
        std::array<int, std::size_t(D)> at{};
        for (int a = D - 1; a >= 0; --a, bin /= K) at[std::size_t(a)] = K - 1 - bin % K;
        return at;
    }

    const float* place(int axis) const { return place_[std::size_t(axis)].data(); }  ///< Positions [cells].
    const float* radius() const { return radius_.data(); }                           ///< Radii [cells].

private:
    /// Returns the first bin of a line of base nodes whose particles reach a node.
    std::size_t first_bin(const int (&node)[D], int line) const {
        int bin = 0;
        for (int a = 0; a < D; ++a) bin = bin * count_[a] + node[a] - (K - 1) + place_of_line(line, a) - first_[a];
        return std::size_t(bin);
    }
    /// Returns where a line begins along an axis, counted from the lowest base node whose particles reach the node.
    static constexpr int place_of_line(int line, int axis) {
        return axis == D - 1 ? 0 : axis == D - 2 ? line % K : line / K;
    }

    int first_[D], count_[D];
    std::vector<std::uint32_t> begin_, next_, order_;
    std::array<std::vector<float>, std::size_t(D)> place_;
    std::vector<float> radius_;
};

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
    using Near = detail::NearParticles<Kernel, D>;
    using Spans = typename Near::Spans;
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
    /// \param node   index of the node, counted from the block's first node
    /// \param moved  how far the first group moves relative to the second in the step [cells]
    /// \param reach  the gap up to which the contact law acts on groups that do not approach [cells]
    /// \param near   the normal found at a node nearby, from which the search starts; zero if there is none
    Separation<D> operator()(const Near& first, const Near& second, const int (&node)[D], const Vec<double, D>& moved,
                             double reach, ContactNormals how, const Vec<double, D>& near) const {
        const Near* const groups[2] = {&first, &second};
        const Spans spans[2] = {first.around(node), second.around(node)};
        const bool by_regression = how == ContactNormals::regression;
        Separation<D> found;
        if (!by_regression)
            found.normal = unit(inward(first, node) - inward(second, node));
        else
            found.normal = dot(near, near) > 0 ? near : discriminant(groups, spans, node);
        if (!(dot(found.normal, found.normal) > 0)) return {};
        const double low = least(first, spans[0], node, found.normal, bulge);
        const double high = -least(second, spans[1], node, -found.normal, bulge);
        if (!(low < none && high > -none)) return {};
        found.gap = low - high;
        const auto may_touch = [&] { return !(found.gap > reach && found.gap + dot(moved, found.normal) > 0); };
        found.may_touch = may_touch();
        if (!found.may_touch || !by_regression) return found;
        const auto look_along = [&](const Vec<double, D>& normal) {
            found.normal = normal;
            found.gap = least(first, spans[0], node, normal, bulge) + least(second, spans[1], node, -normal, bulge);
            return found.may_touch = may_touch();
        };
        if (look_along(regression(groups, node, found.normal, 0.5 * (low + high))))
            look_along(widest(groups, spans, node, found.normal));
        return found;
    }

    static constexpr double none = 1e30;  ///< Above any distance [cells].

    /// Returns how far matter lies from a node along a normal: the smallest n · x − r + ½ κ m of the particles that
    /// contribute to the node, with x counted from the node [cells]. Above `none` if there are no particles.
    static double nearest(const Near& group, const int (&node)[D], const Vec<double, D>& n) {
        return least(group, group.around(node), node, n, bulge);
    }

private:
    static Vec<double, D> unit(const Vec<double, D>& v) {
        const double square = dot(v, v);
        return square > 0 && square < std::numeric_limits<double>::infinity() ? v * (1 / std::sqrt(square))
                                                                              : Vec<double, D>::zero();
    }

    /// Returns the normal after the first Newton step, from β = 0.
    static Vec<double, D> discriminant(const Near* const (&groups)[2], const Spans (&spans)[2], const int (&node)[D]) {
        double weights[2];
        for (int g = 0; g < 2; ++g) {
            const std::uint32_t count = number_of(spans[g]);
            if (count == 0) return Vec<double, D>::zero();
            weights[g] = 0.5 / count;
        }
        const double theta[N] = {};
        return unit(newton_step(groups, spans, weights, node, theta, own_scatter).normal);
    }

    /// Returns the direction in which the volume of a group grows at a node.
    static Vec<double, D> inward(const Near& group, const int (&node)[D]) {
        P sums[D];
        for (P& sum : sums) sum = P(0.f);
        for (int bin = 0; bin < Near::lines * Near::K; ++bin) {
            const auto span = group.bin_around(node, bin);
            const auto place_of_node = Near::node_of_bin(bin);
            for (std::uint32_t i = span.begin; i < span.end; i += 8) {
                P weight[D], slope[D], volume = select(detail::first_lanes(span.end - i), P(1.f), P(0.f));
                for (int a = 0; a < D; ++a) {
                    const int k = place_of_node[std::size_t(a)];
                    const P f = P::load(group.place(a) + i) - P(float(node[a] - k));
                    weight[a] = Kernel::weights(f)[std::size_t(k)];
                    slope[a] = Kernel::gradients(f)[std::size_t(k)];
                    volume = volume * P::load(group.radius() + i);
                }
                for (int a = 0; a < D; ++a) {
                    P term = volume * slope[a];
                    for (int c = 0; c < D; ++c)
                        if (c != a) term = term * weight[c];
                    sums[a] = sums[a] - term;
                }
            }
        }
        Vec<double, D> direction;
        for (int a = 0; a < D; ++a) direction[a] = double(detail::sum_of_lanes(sums[a]));
        return unit(direction);
    }

    /// Returns, of the normal of the regression and of the normals of both groups' own surfaces, the one along which
    /// the groups are farthest apart: where the corner of one body stands on the flat face of another, the plane of the
    /// regression leans.
    static Vec<double, D> widest(const Near* const (&groups)[2], const Spans (&spans)[2], const int (&node)[D],
                                 const Vec<double, D>& normal) {
        const auto gap = [&](const Vec<double, D>& n) {
            return least(*groups[0], spans[0], node, n, 0) + least(*groups[1], spans[1], node, -n, 0);
        };
        Vec<double, D> best = normal;
        double most = gap(normal) + own_advantage;
        for (int g = 0; g < 2; ++g) {
            const Vec<double, D> own = inward(*groups[g], node) * (g == 0 ? 1.0 : -1.0);
            if (!(dot(own, normal) > 0)) continue;
            if (const double here = gap(own); here > most) {
                most = here;
                best = own;
            }
        }
        return best;
    }

    /// Returns the smallest n · x − r + ½ κ m of the particles [cells], with x counted from the node.
    /// \param curvature  κ [1/cell]
    static double least(const Near& group, const Spans& spans, const int (&node)[D], const Vec<double, D>& n,
                        double curvature) {
        P least(std::numeric_limits<float>::max()), normal[D];
        for (int a = 0; a < D; ++a) normal[a] = P(float(n[a]));
        for (const auto& span : spans)
            for (std::uint32_t i = span.begin; i < span.end; i += 8) {
                P along(0), square(0);
                for (int a = 0; a < D; ++a) {
                    const P x = P::load(group.place(a) + i) - P(float(node[a]));
                    along = along + x * normal[a];
                    square = square + x * x;
                }
                const P radius = P::load(group.radius() + i);
                const P beside =
                    max(square - along * along - P(float(flat * flat * (D - 1))) * radius * radius, P(0.f));
                const P depth = along - radius + beside * P(float(0.5 * curvature));
                least = select(detail::first_lanes(span.end - i), min(least, depth), least);
            }
        return -double(reduce_max(-least));
    }

    static std::uint32_t number_of(const Spans& spans) {
        std::uint32_t count = 0;
        for (const auto& span : spans) count += span.end - span.begin;
        return count;
    }

    /// Returns the normal of the plane after Newton's method.
    /// \param start   the normal at the start;  \param middle  n · x of the plane at the start, counted from the node
    static Vec<double, D> regression(const Near* const (&groups)[2], const int (&node)[D], const Vec<double, D>& start,
                                     double middle) {
        double within = band;
        for (int a = 0; a < D; ++a) within += 0.5 * std::abs(start[a]);
        Spans spans[2];
        double weights[2];
        for (int g = 0; g < 2; ++g) {
            spans[g] = groups[g]->near_plane(node, start, middle, within);
            const std::uint32_t count = number_of(spans[g]);
            if (count == 0) return start;
            weights[g] = 0.5 / count;
        }
        double theta[N];
        for (int a = 0; a < D; ++a) theta[a] = sharpness * start[a];
        theta[D] = -sharpness * middle;
        for (int step = 0; step < newton_steps; ++step) {
            const Step to = newton_step(groups, spans, weights, node, theta, penalty);
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
    static Step newton_step(const Near* const (&groups)[2], const Spans (&spans)[2], const double (&weights)[2],
                            const int (&node)[D], const double (&theta)[N], double weight) {
        double H[N][N], to[N];
        sum_terms(groups, spans, weights, node, theta, H, to);
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
    static void sum_terms(const Near* const (&groups)[2], const Spans (&spans)[2], const double (&weights)[2],
                          const int (&node)[D], const double (&theta)[N], double (&H)[N][N], double (&to)[N]) {
        P sums[N * (N + 1) / 2], rest[N], beta[N];
        for (P& sum : sums) sum = P(0);
        for (P& sum : rest) sum = P(0);
        for (int a = 0; a < N; ++a) beta[a] = P(float(theta[a]));
        for (int g = 0; g < 2; ++g) {
            const P sign(g == 0 ? 1.f : -1.f), weight{float(weights[g])};
            for (const auto& span : spans[g])
                for (std::uint32_t i = span.begin; i < span.end; i += 8) {
                    P x[N], z = beta[D];
                    for (int a = 0; a < D; ++a) {
                        x[a] = P::load(groups[g]->place(a) + i) - P(float(node[a]));
                        z = z + x[a] * beta[a];
                    }
                    x[D] = P(1.f);
                    // The probability of the wrong group: 1/(1 + e^z) for the first group, 1/(1 + e^−z) for the second.
                    const P wrong = P(1.f) / (P(1.f) + exp(max(min(z * sign, P(80.f)), P(-80.f))));
                    const P mine = select(detail::first_lanes(span.end - i), weight * wrong, P(0.f));
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
                }
        }
        int k = 0;
        for (int a = 0; a < N; ++a) {
            to[a] = double(detail::sum_of_lanes(rest[a]));
            for (int c = 0; c <= a; ++c) H[a][c] = double(detail::sum_of_lanes(sums[k++]));
        }
    }
};

}  // namespace firn
