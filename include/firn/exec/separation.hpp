/// \file The normal and the gap between two contact groups at a node, from the positions of the particles around it.
///
/// All sums over particles are exact: their terms are rounded to multiples of a small number first. So the results
/// depend neither on the order of the particles nor on the width of the SIMD registers.
#pragma once

#include <firn/contact/concept.hpp>
#include <firn/core/lanes.hpp>
#include <firn/core/pack.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/math/exp_log.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace firn {

namespace detail {

/// Returns t, rounded to a multiple of 2⁻³². Sums of such terms are exact as long as they are below 2²⁰.
template <class P>
FIRN_INLINE P in_exact_units(const P& t) {
    constexpr double whole = 0x1.8p20;
    return (t + P(whole)) - P(whole);
}

/// Number of values of a symmetric D × D matrix and a vector, and 1: the moments of a set of points.
template <int D>
inline constexpr int moment_count = 1 + D + symmetric_size<D>;

/// The particles of one contact group around the nodes of a block. They are sorted by their base nodes.
template <class Kernel, int D>
class NearParticles {
public:
    static constexpr int K = Kernel::support;
    static constexpr int lines = D == 2 ? K : K * K;  ///< Number of lines of base nodes whose particles reach a node.
    static constexpr std::size_t spare = 16;          ///< Numbers behind the last particle that may be read.

    /// A particle. Positions are counted from the lower corner of the block of nodes [cells].
    struct Particle {
        int base[D];                      ///< base node
        double place[D];                  ///< position [cells]
        double shape[symmetric_size<D>];  ///< r² F Fᵀ [cells²]; r is the radius of the undeformed particle
    };
    /// Consecutive particles: those with the indices begin ≤ i < end.
    struct Span {
        std::uint32_t begin, end;
    };
    using Spans = std::array<Span, std::size_t(lines)>;

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
    /// Returns whether a particle with this base node reaches one of the nodes.
    bool reaches(const int (&base)[D]) const {
        for (int a = 0; a < D; ++a)
            if (base[a] < first_[a] || base[a] >= first_[a] + count_[a]) return false;
        return true;
    }
    int first(int axis) const { return first_[axis]; }                    ///< Lowest base node that reaches.
    int last(int axis) const { return first_[axis] + count_[axis] - 1; }  ///< Highest base node that reaches.

    std::vector<Particle> found;  ///< The particles, in any order, until sort() is called.

    /// Sorts the particles by their base nodes, and sums their moments.
    void sort() {
        for (const Particle& p : found) ++begin_[bin(p.base) + 1];
        for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
        next_.assign(begin_.begin(), begin_.end() - 1);
        moments_.assign(next_.size() * padded, 0);
        for (auto& numbers : place_) numbers.resize(found.size() + spare);
        for (auto& numbers : shape_) numbers.resize(found.size() + spare);
        for (const Particle& p : found) {
            const std::size_t b = bin(p.base), i = next_[b]++;
            double* const sum = moments_.data() + b * padded;
            sum[0] += 1;
            int k = 1;
            for (int a = 0; a < D; ++a) {
                place_[std::size_t(a)][i] = p.place[a];
                sum[k++] += in_exact_units(p.place[a]);
            }
            for (int a = 0; a < D; ++a)
                for (int c = a; c < D; ++c) sum[k++] += in_exact_units(p.place[a] * p.place[c]);
            for (std::size_t c = 0; c < shape_.size(); ++c) shape_[c][i] = p.shape[c];
        }
    }

    /// Returns the particles that contribute to a node, and adds their moments to `moments`.
    Spans around(const int (&node)[D], double (&moments)[moment_count<D>]) const {
        Spans spans;
        double sum[padded] = {};
        for (int line = 0; line < lines; ++line) {
            int base[D];
            base[D - 1] = node[D - 1] - (K - 1);
            base[D - 2] = node[D - 2] - (K - 1) + line % K;
            if constexpr (D == 3) base[0] = node[0] - (K - 1) + line / K;
            const std::size_t b = bin(base);
            spans[std::size_t(line)] = {begin_[b], begin_[b + K]};
            for (std::size_t i = b; i < b + K; ++i)
                for (std::size_t k = 0; k < padded; ++k) sum[k] += moments_[i * padded + k];
        }
        for (int k = 0; k < moment_count<D>; ++k) moments[k] += sum[k];
        return spans;
    }

    const double* place(int axis) const { return place_[std::size_t(axis)].data(); }  ///< Positions [cells].
    const double* shape(int k) const { return shape_[std::size_t(k)].data(); }        ///< r² F Fᵀ [cells²].

private:
    static constexpr std::size_t padded = (std::size_t(moment_count<D>) + 3) / 4 * 4;
    std::size_t bin(const int (&base)[D]) const {
        int b = 0;
        for (int a = 0; a < D; ++a) b = b * count_[a] + (base[a] - first_[a]);
        return std::size_t(b);
    }

    int first_[D], count_[D];
    std::vector<std::uint32_t> begin_, next_;
    std::vector<double> moments_;
    std::array<std::vector<double>, std::size_t(D)> place_;
    std::array<std::vector<double>, std::size_t(symmetric_size<D>)> shape_;
};

/// Solves A x = b for a symmetric positive definite N × N matrix, by Cholesky's method.
/// \param A  the matrix; destroyed. Only the lower triangle is read
/// \param b  the right side; receives the solution
/// \return whether the matrix was positive definite
template <int N>
bool solve_definite(double (&A)[N][N], double (&b)[N]) {
    for (int j = 0; j < N; ++j) {
        for (int k = 0; k < j; ++k) A[j][j] -= A[j][k] * A[j][k];
        if (!(A[j][j] > 0)) return false;
        A[j][j] = std::sqrt(A[j][j]);
        for (int i = j + 1; i < N; ++i) {
            for (int k = 0; k < j; ++k) A[i][j] -= A[i][k] * A[j][k];
            A[i][j] /= A[j][j];
        }
    }
    for (int i = 0; i < N; ++i) {
        for (int k = 0; k < i; ++k) b[i] -= A[i][k] * b[k];
        b[i] /= A[i][i];
    }
    for (int i = N - 1; i >= 0; --i) {
        for (int k = i + 1; k < N; ++k) b[i] -= A[k][i] * b[k];
        b[i] /= A[i][i];
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

/// Finds the surface between two contact groups at a node by logistic regression: the plane n · x + b = 0 that
/// minimises
///
///     ½ (mean of log(1 + e⁻ᶻ) over the first group + mean of log(1 + eᶻ) over the second) + ½ λ ‖β‖²,   z = β · x + b
///
/// over the particles that contribute to the node; n = β/‖β‖. The sum is convex. Newton's method starts from β = 0,
/// where it gives Fisher's linear discriminant, and takes a fixed number of steps. Then, with the support function
/// rₚ(n) = ‖r Fₚᵀ n‖ of the particle, a ball in the undeformed state,
///
///     gap = min over the first group of (n · xₚ − rₚ + ½ κ lₚ²)  −  max over the second of (n · xₚ + rₚ − ½ κ lₚ²)
///
/// lₚ is the distance of the particle from the line through the node along n. The term ½ κ l² makes the gap local:
/// without it, the particles that protrude most decide, up to 1.5 cells beside the node. Where round bodies meet, these
/// are the particles nearer to the middle of the contact, so a node at its edge would bear load too early.
///
/// Nairn, Hammerquist and Smith 2020 find the plane in a similar way, by least squares of the logistic function.
/// \tparam Kernel  decides which particles contribute to a node
template <class Kernel, int D>
class Separator {
    using Near = detail::NearParticles<Kernel, D>;
    using Spans = typename Near::Spans;
    using P = native_pack<double>;
    static constexpr int lanes = scalar_traits<P>::lanes, N = D + 1;

public:
    /// The weight λ of the penalty. With it, the layer of particles at the surface decides about the plane.
    static constexpr double penalty = 5e-4;
    static constexpr double sharpness = 8;  ///< ‖β‖ after the start [1/cell]
    static constexpr int newton_steps = 4;  ///< Number of Newton steps after the start.
    static constexpr double band = 1.25;  ///< Newton's method uses particles within this distance of the plane [cells].
    static constexpr double far = 0.75;   ///< Groups with a larger gap at the start cannot touch [cells].
    /// κ: a particle counts as a paraboloid of this curvature [1/cell]. Particles at most a quarter of a cell beside
    /// the node, as with 2 a cell and axis, lie deeper by 0.006 cells; those 1.5 cells beside the node, by 0.22.
    static constexpr double bulge = 0.2;

    /// Returns the surface between two groups at a node.
    /// \param node  index of the node, counted from the block's first node
    Separation<D> operator()(const Near& first, const Near& second, const int (&node)[D], ContactNormals how) {
        const Near* const groups[2] = {&first, &second};
        double moments[2][detail::moment_count<D>] = {};
        Spans spans[2];
        for (int g = 0; g < 2; ++g) {
            spans[g] = groups[g]->around(node, moments[g]);
            centre(moments[g], node);
        }
        if (!(moments[0][0] > 0 && moments[1][0] > 0)) return {};
        Separation<D> found;
        found.normal = how == ContactNormals::regression ? discriminant(moments) : gradient(groups, spans, node);
        if (!(dot(found.normal, found.normal) > 0)) return {};
        double low = least(first, spans[0], node, found.normal), high = -least(second, spans[1], node, -found.normal);
        found.gap = low - high;
        found.may_touch = found.gap < far;
        if (!found.may_touch || how != ContactNormals::regression) return found;
        const Vec<double, D> better = regression(groups, spans, node, found.normal, 0.5 * (low + high));
        low = least(first, spans[0], node, better);
        high = -least(second, spans[1], node, -better);
        return {better, low - high, true};
    }

private:
    /// Turns moments about the corner of the block into means about a node; the count stays.
    static void centre(double (&m)[detail::moment_count<D>], const int (&node)[D]) {
        if (!(m[0] > 0)) return;
        double mean[D];
        for (int a = 0; a < D; ++a) mean[a] = m[1 + a] / m[0];
        int k = 1 + D;
        for (int a = 0; a < D; ++a)
            for (int c = a; c < D; ++c, ++k)
                m[k] = m[k] / m[0] - mean[a] * node[c] - mean[c] * node[a] + double(node[a]) * node[c];
        for (int a = 0; a < D; ++a) m[1 + a] = mean[a] - node[a];
    }

    static Vec<double, D> unit(const Vec<double, D>& v) {
        const double square = dot(v, v);
        return square > 0 && square < std::numeric_limits<double>::infinity() ? v * (1 / std::sqrt(square))
                                                                              : Vec<double, D>::zero();
    }

    /// Returns the normal after the first Newton step, from β = 0.
    static Vec<double, D> discriminant(const double (&moments)[2][detail::moment_count<D>]) {
        double H[N][N] = {}, to[N] = {};
        for (int g = 0; g < 2; ++g) {
            const double* const m = moments[g];
            int k = 1 + D;
            for (int a = 0; a < D; ++a) {
                for (int c = a; c < D; ++c) H[c][a] += 0.125 * m[k++];
                H[D][a] += 0.125 * m[1 + a];
                to[a] += (g == 0 ? 0.25 : -0.25) * m[1 + a];
            }
            H[D][D] += 0.125;
        }
        for (int a = 0; a < D; ++a) H[a][a] += penalty;
        if (!detail::solve_definite(H, to)) return Vec<double, D>::zero();
        Vec<double, D> normal;
        for (int a = 0; a < D; ++a) normal[a] = to[a];
        return unit(normal);
    }

    /// Returns the normal from the gradients of the volumes of both groups at a node.
    static Vec<double, D> gradient(const Near* const (&groups)[2], const Spans (&spans)[2], const int (&node)[D]) {
        Vec<double, D> sum = Vec<double, D>::zero();
        for (int g = 0; g < 2; ++g) {
            Vec<double, D> of_group = Vec<double, D>::zero();
            for (const auto& span : spans[g])
                for (std::uint32_t i = span.begin; i < span.end; ++i) {
                    double weight[D], slope[D];
                    for (int a = 0; a < D; ++a) {
                        const double x = groups[g]->place(a)[i], base = base_node<Kernel>(x);
                        const auto k = std::size_t(std::clamp(node[a] - int(base), 0, Kernel::support - 1));
                        weight[a] = Kernel::weights(x - base)[k];
                        slope[a] = Kernel::gradients(x - base)[k];
                    }
                    for (int a = 0; a < D; ++a) {
                        double term = -slope[a];
                        for (int c = 0; c < D; ++c)
                            if (c != a) term *= weight[c];
                        of_group[a] += detail::in_exact_units(term);
                    }
                }
            sum += unit(of_group) * (g == 0 ? 1.0 : -1.0);
        }
        return unit(sum);
    }

    /// Returns the smallest n · x − r(n) + ½ κ l² of the particles [cells], with x counted from the node.
    static double least(const Near& group, const Spans& spans, const int (&node)[D], const Vec<double, D>& n) {
        P least(std::numeric_limits<double>::infinity());
        for (const auto& span : spans)
            for (std::uint32_t i = span.begin; i < span.end; i += lanes) {
                P along(0), square(0), distance(0);  // the last one squared
                int k = 0;
                for (int a = 0; a < D; ++a) {
                    const P x = P::load(group.place(a) + i) - P(double(node[a]));
                    along = along + x * P(n[a]);
                    distance = distance + x * x;
                    for (int c = a; c < D; ++c)
                        square = square + P::load(group.shape(k++) + i) * P(n[a] * n[c] * (a == c ? 1 : 2));
                }
                const P reach = along - sqrt(max(square, P(0))) + (distance - along * along) * P(0.5 * bulge);
                least = select(number() < P(double(span.end - i)), min(least, reach), least);
            }
        return -reduce_max(-least);
    }
    /// Returns the numbers of the lanes: 0, 1, 2, …
    static P number() {
        alignas(64) double numbers[lanes];
        for (int l = 0; l < lanes; ++l) numbers[l] = l;
        return P::load(numbers);
    }

    /// Returns the normal of the plane after Newton's method.
    /// \param start   the normal at the start;  \param middle  n · x of the plane at the start, counted from the node
    Vec<double, D> regression(const Near* const (&groups)[2], const Spans (&spans)[2], const int (&node)[D],
                              const Vec<double, D>& start, double middle) {
        std::size_t counts[2];
        for (int g = 0; g < 2; ++g) counts[g] = choose(*groups[g], spans[g], node, start, middle, chosen_[g]);
        if (counts[0] == 0 || counts[1] == 0) return start;
        double theta[N];
        for (int a = 0; a < D; ++a) theta[a] = sharpness * start[a];
        theta[D] = -sharpness * middle;
        for (int step = 0; step < newton_steps; ++step) {
            double H[N][N] = {}, to[N] = {};
            for (int g = 0; g < 2; ++g) add_sums(g, counts[g], theta, H, to);
            for (int a = 0; a < D; ++a) {
                H[a][a] += penalty;
                to[a] -= penalty * theta[a];
            }
            if (!detail::solve_definite(H, to)) break;
            double square = 0;
            for (int a = 0; a < N; ++a) square += to[a] * to[a];
            const double most = 0.5 * sharpness, part = square > most * most ? most / std::sqrt(square) : 1.0;
            for (int a = 0; a < N; ++a) theta[a] += part * to[a];
        }
        Vec<double, D> normal;
        for (int a = 0; a < D; ++a) normal[a] = theta[a];
        normal = unit(normal);
        return dot(normal, start) > 0 ? normal : start;
    }

    /// Copies the positions of the particles near the plane, counted from the node. \return their number
    static std::size_t choose(const Near& group, const Spans& spans, const int (&node)[D], const Vec<double, D>& n,
                              double middle, std::array<std::vector<double>, std::size_t(D)>& to) {
        std::size_t most = 0, count = 0;
        for (const auto& span : spans) most += span.end - span.begin;
        for (auto& numbers : to)
            if (numbers.size() < most + Near::spare) numbers.resize(most + Near::spare);
        for (const auto& span : spans)
            for (std::uint32_t i = span.begin; i < span.end; ++i) {
                double along = -middle;
                for (int a = 0; a < D; ++a) along += n[a] * (to[std::size_t(a)][count] = group.place(a)[i] - node[a]);
                count += std::abs(along) <= band;
            }
        for (auto& numbers : to) std::fill_n(numbers.begin() + std::ptrdiff_t(count), Near::spare, 0.0);
        return count;
    }

    /// Adds the terms of one group to the matrix and the right side of a Newton step.
    void add_sums(int g, std::size_t count, const double (&theta)[N], double (&H)[N][N], double (&to)[N]) const {
        P sums[N * (N + 1) / 2], rest[N];
        for (P& sum : sums) sum = P(0);
        for (P& sum : rest) sum = P(0);
        const double sign = g == 0 ? 1 : -1;
        for (std::size_t i = 0; i < count; i += lanes) {
            P x[N], z = P(theta[D]);
            for (int a = 0; a < D; ++a) {
                x[a] = P::load(chosen_[g][std::size_t(a)].data() + i);
                z = z + x[a] * P(theta[a]);
            }
            x[D] = P(1);
            // The probability of the wrong group: 1/(1 + e^z) for the first group.
            const P wrong =
                select(number() < P(double(count - i)), P(1) / (P(1) + exp(min(z * P(sign), P(700)))), P(0));
            const P curvature = wrong * (P(1) - wrong);
            int k = 0;
            for (int a = 0; a < N; ++a) {
                rest[a] = rest[a] + detail::in_exact_units(wrong * x[a]);
                const P part = curvature * x[a];
                for (int c = 0; c <= a; ++c) {
                    sums[k] = sums[k] + detail::in_exact_units(part * x[c]);
                    ++k;
                }
            }
        }
        const double weight = 0.5 / double(count);
        int k = 0;
        for (int a = 0; a < N; ++a) {
            to[a] += sign * weight * sum_of(rest[a]);
            for (int c = 0; c <= a; ++c) H[a][c] += weight * sum_of(sums[k++]);
        }
    }
    static double sum_of(const P& lanes_of) {
        double sum = 0;
        for (int l = 0; l < lanes; ++l) sum += lanes_of[l];
        return sum;
    }

    std::array<std::vector<double>, std::size_t(D)> chosen_[2];
};

}  // namespace firn
