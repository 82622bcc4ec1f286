/// \file Distance constraints, which keep pairs of points at a given distance, for cloth, soft bodies and ropes.
#pragma once

#include <firn/core/digest.hpp>
#include <firn/lagrangian/colouring.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/lagrangian/tearing.hpp>

#include <atomic>
#include <numeric>
#include <optional>

namespace firn {

/// The order in which constraints correct positions in one iteration.
enum class ConstraintUpdate {
    /// Constraints act one by one, in the order they were added, on one thread. This converges fastest for chains.
    immediate,
    /// One colour acts after another; the constraints of one colour act in parallel. The result is the same, bit for
    /// bit, for any number of threads.
    coloured,
    /// All constraints act at once: a point moves by an average of its constraints' corrections. This converges
    /// slowest.
    averaged
};

/// The options of the constraints that are made from the links of one kind.
struct ConstraintOptions {
    /// Compliance α of XPBD, the inverse of a spring's stiffness [m/N]; 0: rigid. The resulting stiffness of the body
    /// depends neither on the number of iterations nor on the time step.
    double compliance = 0;
    /// The fraction of each correction that is applied, above 0 and at most 1. The resulting stiffness of the body
    /// depends on the number of iterations.
    double relaxation = 1;
    bool kept = true;  ///< Whether constraints are made from the links of this kind.
    /// A constraint tears at the end of a step if it is longer than this factor times its length at rest. The factor
    /// must be above 1; infinite: these constraints never tear. Empty: DistanceConstraints::tear_factor, which is
    /// infinite by default.
    std::optional<double> tear_factor = {};

    /// Checks compliance, relaxation and tear factor.
    /// \throws parameter_error  if the compliance is negative or not finite, if the relaxation is outside ]0, 1], or if
    ///                          the tear factor is not above 1
    void check() const {
        if (!(compliance >= 0) || !std::isfinite(compliance) || !(relaxation > 0 && relaxation <= 1))
            throw parameter_error(sentence("A constraint of compliance ", compliance, " m/N and relaxation ",
                                           relaxation,
                                           ": the compliance must be finite and not negative, the relaxation above 0 "
                                           "and at most 1."));
        if (tear_factor) detail::check_tear_factor(*tear_factor);
    }
};
/// The options for each kind of link, in the order of LinkKind.
using ConstraintsOfKinds = std::array<ConstraintOptions, link_kinds>;

namespace detail {

/// The correction of the distance l between two points a and b (Macklin, Müller, Chentanez 2016, eq. 18):
///
///     x_a −= w_a Δλ e,  x_b += w_b Δλ e,  with  e = (x_b − x_a)/l,  Δλ = (l₀ − l − α̃ λ)/(w_a + w_b + α̃),  α̃ = α/dt²
///
/// Here x_a and x_b are the positions of the points, w_a and w_b their inverse masses, l₀ is the length at rest, α the
/// compliance, dt the time step, and λ the sum of all Δλ computed earlier in the same step. If both points are at the
/// same position, e is the unit vector along the second axis. The constructor's parameter `weights` is w_a + w_b, and
/// its parameter `compliance` is α̃.
template <scalar S, int D>
struct DistanceCorrection {
    Vec<S, D> impulse;  ///< Δλ e [kg m]
    S multiplier;       ///< Δλ [kg m]

    FIRN_INLINE DistanceCorrection(const Vec<S, D>& a, const Vec<S, D>& b, const S& weights, const S& rest,
                                   const S& compliance, const S& lambda) {
        const Vec<S, D> between = b - a;
        const S square = dot(between, between);
        const auto apart = S(1e-30) < square;
        const S length = sqrt(square), divisor = select(apart, length, S(1));
        Vec<S, D> up = Vec<S, D>::zero();
        up[1] = S(1);
        const auto can_move = S(0) < weights;
        const S missing = rest - length - compliance * lambda;
        const S per_length = missing / select(can_move, (weights + compliance) * divisor, S(1));
        const S scale = select(can_move, per_length, S(0));
        impulse = select(apart, between, up) * scale;
        multiplier = scale * divisor;
    }
};

}  // namespace detail

/// Lists which constraints were removed during a run, and the colours of the remaining constraints. The index of a
/// constraint is 0, 1, 2, … in the order in which the constraints were added.
struct ConstraintHistory {
    std::uint32_t added = 0;  ///< Number of constraints added, including those that were removed later.
    /// The indices of all constraints that were removed, in ascending order.
    std::vector<std::uint32_t> gone = {};
    /// One colour per remaining constraint, in the order they were added; empty if no colours were computed yet.
    std::vector<std::uint8_t> colours = {};
};

/// Distance constraints |x_b − x_a| = l₀ between pairs of points, where x_a and x_b are the positions of the two points
/// and l₀ is the length at rest. They are solved by iterations of position-based dynamics.
template <std::floating_point S, int D>
class DistanceConstraints {
public:
    using Ends = std::array<std::uint32_t, 2>;  ///< The indices (into PointMasses) of two points.

    ConstraintUpdate update = ConstraintUpdate::coloured;  ///< The order in which an iteration corrects positions.
    /// A constraint tears at the end of a step if it is longer than this factor times its length at rest. The factor
    /// must be above 1; infinite: constraints never tear. It does not hold for constraints with a tear factor of their
    /// own, see ConstraintOptions::tear_factor. \see ParticleSystem::tear
    double tear_factor = std::numeric_limits<double>::infinity();

    /// A constraint: two points and their distance at rest.
    struct Constraint {
        Ends ends{};  ///< The indices of the two points.
        S rest = 1;   ///< l₀, length at rest [m].
    };

    /// Returns the number of constraints.
    std::size_t size() const { return all_.size(); }
    /// Returns a digest of all constraints as they were added, including those that were removed later.
    std::uint64_t digest() const { return as_added_.value(); }
    /// Returns the constraints, in the order in which solve() corrects them.
    std::span<const Constraint> all() const { return all_; }

    /// Adds one constraint.
    /// \param ends     the indices of the two points
    /// \param rest     the distance of the two points at rest [m]
    /// \param options  compliance, relaxation and tear factor of the constraint; `kept` has no effect
    /// \param kind     the kind of link. When links tear, constraints of the kinds shear and bend may go with them, see
    ///                 ParticleSystem::tear.
    /// \throws parameter_error  if the distance at rest is not positive and finite, if both indices are equal, or if
    ///                          ConstraintOptions::check throws it
    void add(const Ends& ends, double rest, const ConstraintOptions& options = {}, LinkKind kind = LinkKind::stretch) {
        options.check();
        if (!(S(rest) > 0) || !std::isfinite(S(rest)) || ends[0] == ends[1])
            throw parameter_error(
                sentence("A constraint between points ", ends[0], " and ", ends[1], " of length ", rest,
                         " m: the length must be positive and finite, and the two points must differ."));
        factors_.add(options.tear_factor, size());
        as_added_.add(ends).add(rest).add(options.compliance).add(options.relaxation).add(kind);
        as_added_.add(options.tear_factor.value_or(0));
        all_.push_back({ends, S(rest)});
        softness_.push_back({S(options.compliance), S(options.relaxation)});
        origin_.push_back({added_++, kind});
        is_soft_ = is_soft_ || options.compliance > 0 || options.relaxation < 1;
        ordered_ = false;
    }
    /// Adds a constraint for each link of a net. The length at rest is the length of the link in the net.
    /// \param net      the net
    /// \param options  the options for each kind of link
    /// \param first    the index of the net's first point in the system, as ParticleSystem::add returned it
    /// \throws parameter_error  if a link has length zero or names a point that does not exist, or if
    ///                          ConstraintOptions::check throws it
    void add(const Net<D>& net, const ConstraintsOfKinds& options, std::size_t first = 0) {
        for (const ConstraintOptions& each : options) each.check();
        for (const Link& link : net.links) detail::checked_rest_length(net, link);
        for (const Link& link : net.links)
            if (const ConstraintOptions& of = options[std::size_t(link.kind)]; of.kept)
                add({detail::moved_place(link.a, first), detail::moved_place(link.b, first)},
                    detail::checked_rest_length(net, link), of, link.kind);
    }
    /// Adds a constraint for each link of a net, with the same options for all kinds of links.
    /// \param net     the net
    /// \param of_all  the options for all links
    /// \param first   the index of the net's first point in the system, as ParticleSystem::add returned it
    /// \throws parameter_error  if a link has length zero or names a point that does not exist, or if
    ///                          ConstraintOptions::check throws it
    void add(const Net<D>& net, const ConstraintOptions& of_all = {}, std::size_t first = 0) {
        ConstraintsOfKinds options;
        options.fill(of_all);
        add(net, options, first);
    }

    /// Moves the points so that the length of each constraint approaches its length at rest.
    /// \param position      position of each point [m], changed in place
    /// \param inverse_mass  inverse mass of each point [1/kg]; 0: the point does not move
    /// \param dt            time step [s]
    /// \param iterations    number of iterations, 0 or more
    /// \param threads       number of threads; 0: the number that thread_count() returns
    /// \throws parameter_error  if a constraint names a point that does not exist, if tear_factor is not above 1, if dt
    ///                          is not positive and finite, if `iterations` is negative, or if `inverse_mass` does not
    ///                          have one entry per point
    void solve(std::span<Vec<S, D>> position, std::span<const S> inverse_mass, double dt, int iterations, int threads) {
        if (!(dt > 0) || !std::isfinite(dt) || iterations < 0 || inverse_mass.size() != position.size())
            throw parameter_error(sentence("Constraints of ", position.size(), " points with ", inverse_mass.size(),
                                           " inverse masses in ", iterations, " iterations over ", dt,
                                           " s: give one inverse mass per point, 0 or more iterations, and a positive "
                                           "step."));
        detail::check_tear_factor(tear_factor);
        if (size() == 0) return;
        prepare(position.size());
        const S per_dt2 = S(1 / (dt * dt));
        for (Softness& each : softness_) each.lambda = 0;
        for (int i = 0; i < iterations; ++i) {
            if (update == ConstraintUpdate::averaged)
                average(position, inverse_mass, per_dt2, threads);
            else if (is_soft_)
                iterate<true>(position, inverse_mass, per_dt2, threads);
            else
                iterate<false>(position, inverse_mass, per_dt2, threads);
        }
    }

    /// Removes the constraints that tear, and those that have lost their support. ParticleSystem::tear says which these
    /// are.
    /// \param position  position of each point [m]
    /// \return the indices of the two end points of each removed constraint
    std::vector<Torn> torn(std::span<const Vec<S, D>> position) {
        if (!is_overlong(position, 1)) return {};
        std::vector<detail::TearingLink<S>> links;
        list_links(links);
        std::vector<Torn> broken = detail::torn_links<S, D>(links, position);
        tear(broken);
        return broken;
    }
    /// Returns whether some constraint is longer than its tear factor allows. Call solve() first, which checks the
    /// constraints' point indices.
    /// \param position  position of each point [m]
    /// \param threads   number of threads; 0: the number that thread_count() returns
    bool is_overlong(std::span<const Vec<S, D>> position, int threads) const {
        if (!factors_.may_tear(tear_factor)) return false;
        const S of_others = factors_.square(tear_factor);
        std::atomic<bool> found = false;
        detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            bool any = false;
            for (std::size_t k = first; k < last; ++k) {
                const auto [a, b] = all_[k].ends;
                any |= detail::is_too_long(position[a], position[b], all_[k].rest, factors_.square_of(k, of_others));
            }
            if (any) found = true;
        });
        return found;
    }
    /// Adds the constraints to a list of links that tear together.
    void list_links(std::vector<detail::TearingLink<S>>& links) const {
        const S of_others = factors_.square(tear_factor);
        for (std::size_t k = 0; k < size(); ++k)
            links.push_back({all_[k].ends, all_[k].rest, factors_.square_of(k, of_others), origin_[k].kind});
    }
    /// Removes the constraints that join the two end points of a torn link.
    void tear(std::span<const Torn> torn) {
        const detail::TornLinks links(torn);
        keep_if([&](const Constraint& each, const Origin&) { return !links.are_in(each.ends); });
    }

    /// Updates the constraints' point indices. Constraints that have lost an end point are removed. Call renumber()
    /// after points are removed.
    /// \param new_place  the list that PointMasses::remove_if returned: the new index for each old one
    /// \throws parameter_error  if a constraint names a point without an entry in new_place
    void renumber(std::span<const std::uint32_t> new_place) {
        keep_if([&](Constraint& each, const Origin&) { return detail::renumbered(each.ends, new_place); });
        incidence_.clear();
    }

    /// Returns the indices of the constraints that were removed so far, and the colours of the remaining constraints.
    /// Pass the result to resume().
    ConstraintHistory history() const {
        constexpr std::uint8_t none = 255;
        std::vector<std::uint8_t> colour(added_, none);
        for (const Origin& origin : origin_) colour[origin.number] = origin.colour;
        ConstraintHistory history{added_, {}, {}};
        for (std::uint32_t number = 0; number < added_; ++number)
            if (colour[number] == none) history.gone.push_back(number);
        if (ordered_ && ordered_for_ == ConstraintUpdate::coloured) {
            std::erase(colour, none);
            history.colours = std::move(colour);
        }
        return history;
    }
    /// Brings these constraints to the state that the same constraints had in another run.
    /// \param history    the history that history() returned in the other run
    /// \param new_place  for each point, by its present index: the point's index in the other run, or no_particle if
    ///                   the point was removed in the other run
    /// \param points     number of points in the other run
    /// \throws parameter_error  if the history does not fit these constraints; some of these constraints may be removed
    ///                          then
    void resume(const ConstraintHistory& history, std::span<const std::uint32_t> new_place, std::size_t points) {
        if (history.added != added_)
            throw parameter_error(sentence("The run to resume had ", history.added,
                                           " constraints added to it, this one ", added_, ". Add the same."));
        std::vector<bool> is_gone(added_);
        for (std::size_t k = 0; k < history.gone.size(); ++k) {
            if (history.gone[k] >= added_ || (k > 0 && history.gone[k] <= history.gone[k - 1]))
                throw parameter_error("The numbers of the constraints that are gone must be ascending, each once.");
            is_gone[history.gone[k]] = true;
        }
        keep_if([&](Constraint&, const Origin& origin) { return !is_gone[origin.number]; });
        renumber(new_place);
        if (size() + history.gone.size() != added_)
            throw parameter_error(
                sentence("Of the ", added_, " constraints added, the run to resume still had ",
                         added_ - history.gone.size(), ", but only ", size(),
                         " of these still have both of their points. Add the same constraints and points."));
        ordered_ = false;
        if (history.colours.empty()) return;
        order_by_number();
        if (!are_colours(history.colours, all_ends(), points))
            throw parameter_error(
                "Two constraints of one colour share a point; the constraints of a point need different colours.");
        order_by_colours(history.colours);
        ordered_ = true;
        checked_for_ = std::numeric_limits<std::size_t>::max();  // not checked yet
        ordered_for_ = ConstraintUpdate::coloured;
        find_colours();
    }

private:
    /// The data of a constraint that are used only if some constraint has a compliance above 0 or a relaxation below 1.
    struct Softness {
        S compliance = 0, relaxation = 1;
        S lambda = 0;  // λ, the sum of all corrections Δλ in this step [N s²]; see DistanceCorrection
    };
    struct Origin {
        std::uint32_t number = 0;  // index in the order in which constraints were added
        LinkKind kind = LinkKind::stretch;
        std::uint8_t colour = 0;
    };

    template <bool Soft>
    FIRN_INLINE void correct(std::size_t k, Vec<S, D>* position, const S* inverse_mass, S per_dt2) {
        const auto [a, b] = all_[k].ends;
        const S wa = inverse_mass[a], wb = inverse_mass[b];
        const S compliance = Soft ? softness_[k].compliance * per_dt2 : S(0),
                lambda = Soft ? softness_[k].lambda : S(0);
        const detail::DistanceCorrection<S, D> by(position[a], position[b], wa + wb, all_[k].rest, compliance, lambda);
        const S part = Soft ? softness_[k].relaxation : S(1);
        if constexpr (Soft) softness_[k].lambda += by.multiplier * part;
        position[a] -= by.impulse * (wa * part);
        position[b] += by.impulse * (wb * part);
    }

    template <bool Soft>
    void iterate(std::span<Vec<S, D>> points, std::span<const S> inverse_masses, S per_dt2, int threads) {
        Vec<S, D>* const position = points.data();
        const S* const inverse_mass = inverse_masses.data();
        if (update == ConstraintUpdate::immediate) {
            for (std::size_t k = 0; k < size(); ++k) correct<Soft>(k, position, inverse_mass, per_dt2);
            return;
        }
        // The constraints of one colour are split into pieces that run in parallel. Constraints without a colour run
        // one by one.
        std::vector<std::size_t> counts(colour_end_.size());
        for (std::size_t c = 0; c < counts.size(); ++c)
            counts[c] = is_serial(c) ? 1 : (colour_end_[c] - colour_begin(c) + detail::at_once - 1) / detail::at_once;
        parallel_phases(counts, thread_count(threads), [&](std::size_t c, std::size_t piece, int) {
            const std::size_t begin = colour_begin(c) + piece * detail::at_once;
            const std::size_t end = is_serial(c) ? colour_end_[c] : std::min(begin + detail::at_once, colour_end_[c]);
            for (std::size_t k = begin; k < end; ++k) correct<Soft>(k, position, inverse_mass, per_dt2);
        });
    }

    /// Does one iteration of ConstraintUpdate::averaged. Each correction is divided by a count n. To get n, count the
    /// constraints at each of the two end points; n is the larger count. The division conserves momentum, and it keeps
    /// the sum of the corrections at a point from becoming too large.
    void average(std::span<Vec<S, D>> position, std::span<const S> inverse_mass, S per_dt2, int threads) {
        renew(impulses_, size(), thread_count(threads));
        detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t k = first; k < last; ++k) {
                const auto [a, b] = all_[k].ends;
                Softness& soft = softness_[k];
                const detail::DistanceCorrection<S, D> by(position[a], position[b], inverse_mass[a] + inverse_mass[b],
                                                          all_[k].rest, soft.compliance * per_dt2, soft.lambda);
                const std::size_t most = std::max(incidence_.of(a).size(), incidence_.of(b).size());
                const S part = soft.relaxation / S(most);
                soft.lambda += by.multiplier * part;
                impulses_[k] = by.impulse * part;
            }
        });
        detail::for_chunks(position.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                Vec<S, D> sum = Vec<S, D>::zero();
                for (const std::uint32_t corner : incidence_.of(i))
                    sum += corner % 2 == 0 ? -impulses_[corner / 2] : impulses_[corner / 2];
                position[i] += sum * inverse_mass[i];
            }
        });
    }

    std::size_t colour_begin(std::size_t c) const { return c == 0 ? 0 : colour_end_[c - 1]; }
    bool is_serial(std::size_t c) const { return origin_[colour_begin(c)].colour == LinkColours::most; }

    std::vector<Ends> all_ends() const {
        std::vector<Ends> ends;
        ends.reserve(size());
        for (const Constraint& each : all_) ends.push_back(each.ends);
        return ends;
    }

    void prepare(std::size_t points) {
        if (!ordered_ || points < checked_for_) {
            for (std::size_t k = 0; k < size(); ++k)
                for (const std::uint32_t point : all_[k].ends)
                    if (point >= points)
                        throw parameter_error(sentence("Constraint ", origin_[k].number, " keeps a distance to point ",
                                                       point, "; there are ", points, ", counted from 0."));
        }
        checked_for_ = points;
        if (!ordered_ || ordered_for_ != update) {
            order_by_number();
            if (update == ConstraintUpdate::coloured) order_by_colours(LinkColours(all_ends(), points).colour);
            ordered_ = true;
            ordered_for_ = update;
            incidence_.clear();
            find_colours();
        }
        if (update == ConstraintUpdate::averaged && !incidence_.is_for(points)) {
            const std::vector<Ends> ends = all_ends();
            incidence_ = Incidence(std::span<const Ends>(ends), points);
        }
    }
    void order_by_number() {
        order_by([](const Origin& a, const Origin& b) { return a.number < b.number; });
    }
    /// Sorts the constraints by colour, and the constraints of one colour by Origin::number.
    /// \param colours  the colour of each constraint, in the order of Origin::number; the constraints must already be
    ///                 in this order
    void order_by_colours(std::span<const std::uint8_t> colours) {
        for (std::size_t k = 0; k < size(); ++k) origin_[k].colour = colours[k];
        order_by([](const Origin& a, const Origin& b) {
            return a.colour != b.colour ? a.colour < b.colour : a.number < b.number;
        });
    }
    template <class Before>
    void order_by(const Before& before) {
        std::vector<std::uint32_t> order(size());
        std::iota(order.begin(), order.end(), 0U);
        std::sort(order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return before(origin_[a], origin_[b]); });
        const auto permute = [&](auto& values) {
            auto sorted = values;
            for (std::size_t k = 0; k < order.size(); ++k) sorted[k] = values[order[k]];
            values = std::move(sorted);
        };
        permute(all_), permute(softness_), permute(origin_);
        factors_.permute(order);
    }
    void find_colours() {
        colour_end_.clear();
        for (std::size_t k = 0; k < size(); ++k)
            if (k + 1 == size() || origin_[k].colour != origin_[k + 1].colour) colour_end_.push_back(k + 1);
    }

    /// Removes the constraints for which wanted(constraint, origin) is false. The remaining constraints keep their
    /// order and colours.
    template <class Wanted>
    void keep_if(const Wanted& wanted) {
        std::size_t to = 0;
        for (std::size_t k = 0; k < size(); ++k)
            if (wanted(all_[k], origin_[k])) {
                all_[to] = all_[k];
                softness_[to] = softness_[k];
                factors_.move(k, to);
                origin_[to++] = origin_[k];
            }
        if (to == size()) return;
        all_.resize(to);
        softness_.resize(to);
        factors_.shrink(to);
        origin_.resize(to);
        incidence_.clear();
        find_colours();
    }

    std::vector<Constraint> all_;
    std::vector<Softness> softness_;
    std::vector<Origin> origin_;
    detail::TearFactors<S> factors_;
    Digest as_added_;
    std::vector<std::size_t> colour_end_;
    Incidence incidence_;
    aligned_vector<Vec<S, D>> impulses_;
    std::uint32_t added_ = 0;
    bool is_soft_ = false, ordered_ = false;
    std::size_t checked_for_ = 0;  // number of points when the constraints' point indices were last checked
    ConstraintUpdate ordered_for_ = ConstraintUpdate::coloured;
};

}  // namespace firn
