/// \file Distance constraints, which keep pairs of points at a given distance, for cloth, soft bodies and ropes.
#pragma once

#include <firn/core/digest.hpp>
#include <firn/lagrangian/colouring.hpp>
#include <firn/lagrangian/link_solver.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/lagrangian/tearing.hpp>

#include <atomic>
#include <numeric>
#include <optional>

namespace firn::inline FIRN_BUILD {

/// The order in which constraints correct positions in one iteration.
///
/// As long as the iterations have not solved the constraints, the result depends on their order. So a body that is
/// symmetric moves askew if they act one after another: a cloth of 2 m and 20 × 20 cells, which hangs by two corners
/// with 8 iterations, hangs askew by 13 mm with steps of 10 ms, and by 2 mm with steps of 2 ms.
enum class ConstraintUpdate {
    /// Constraints act one by one, in the order they were added, on one thread. This converges fastest for chains.
    immediate,
    /// One colour acts after another; the constraints of one colour act in parallel. The result is the same, bit for
    /// bit, for any number of threads.
    coloured,
    /// All constraints act at once: a point moves by an average of its constraints' corrections. This converges
    /// slowest. What is symmetric stays symmetric.
    averaged
};

/// The options of the constraints that are made from the links of one kind.
struct ConstraintOptions {
    /// Compliance α of XPBD, the inverse of a spring's stiffness [m/N]; 0: rigid.
    ///
    /// Once the iterations have solved the constraints, the stiffness of the body depends neither on their number nor
    /// on the time step. Until then, it does. A chain of 10 links of 1e-4 m/N that carries 1 kg between points of 1 kg
    /// is right with 8 iterations of 10 ms. Between points of 1 g, its stretch is 113 times too large with them, 1.7
    /// times with 8 iterations of 1 ms, and right with 100 iterations of 1 ms. Smaller steps help more than more
    /// iterations. A system warns: see DistanceConstraints::compliant_tolerance.
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
/// and l₀ is the length at rest. They are solved by iterations: SHAKE with the compliance of XPBD, see link_solver.hpp.
///
/// What rigid links turn keeps its angular momentum to rounding, and its energy as well as Verlet's method does. This
/// ends where a link turns by more than 60° in a step, or where light points carry so much that their motion across the
/// link is too fast for the step, k > 2 in link_solver.hpp: there, links damp.
template <std::floating_point S, int D>
class DistanceConstraints {
public:
    using Ends = std::array<std::uint32_t, 2>;  ///< The indices (into PointMasses) of two points.
    using Place = Vec<double, D>;               ///< A position [m].

    ConstraintUpdate update = ConstraintUpdate::coloured;  ///< The order in which an iteration corrects positions.
    /// A constraint tears at the end of a step if it is longer than this factor times its length at rest. The factor
    /// must be above 1; infinite: constraints never tear. It does not hold for constraints with a tear factor of their
    /// own, see ConstraintOptions::tear_factor. \see ParticleSystem::tear
    double tear_factor = std::numeric_limits<double>::infinity();
    /// A system warns once if its iterations leave constraints with errors above these; infinite: never.
    /// @{
    double rigid_tolerance = 1e-3;      ///< Of constraints without compliance: see ConstraintErrors::rigid [1].
    double compliant_tolerance = 0.02;  ///< Of constraints with compliance: see ConstraintErrors::compliant [1].
    /// @}

    using Constraint = DistanceConstraint<S>;  ///< A constraint: two points and their distance at rest.

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
        solver_.add(S(rest), S(options.compliance), S(options.relaxation));
        origin_.push_back({added_++, kind});
        ordered_ = are_counted_ = is_solved_ = false;
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

    /// Changes the displacements of the points in a step, so that the length of each constraint at the end of the step
    /// approaches its length at rest. link_solver.hpp has the formula.
    /// \param start         position of each point at the beginning of the step [m]
    /// \param moved         displacement of each point in the step [m], changed in place
    /// \param inverse_mass  inverse mass of each point [1/kg]; 0: its displacement does not change
    /// \param dt            time step [s]
    /// \param iterations    number of iterations, 0 or more
    /// \param threads       number of threads; 0: the number that thread_count() returns
    /// \throws parameter_error  if a constraint names a point that does not exist, if tear_factor is not above 1, if dt
    ///                          is not positive and finite, if `iterations` is negative, or if `moved` or
    ///                          `inverse_mass` does not have one entry per point
    void solve(std::span<const Place> start, std::span<Vec<S, D>> moved, std::span<const S> inverse_mass, double dt,
               int iterations, int threads) {
        const std::size_t points = start.size();
        if (!(dt > 0) || !std::isfinite(dt) || iterations < 0 || inverse_mass.size() != points ||
            moved.size() != points)
            throw parameter_error(sentence("Constraints of ", points, " points with ", inverse_mass.size(),
                                           " inverse masses and ", moved.size(), " displacements in ", iterations,
                                           " iterations over ", dt,
                                           " s: give one inverse mass and one displacement per point, 0 or more "
                                           "iterations, and a positive step."));
        detail::check_tear_factor(tear_factor);
        is_solved_ = false;
        if (size() == 0 || iterations == 0) return;
        prepare(points);
        solver_.begin(all_, start, moved, inverse_mass, dt, threads);
        for (int i = 0; i < iterations; ++i) {
            if (update == ConstraintUpdate::averaged)
                average(inverse_mass, threads);
            else
                iterate(threads);
        }
        solver_.end(moved, threads);
        is_solved_ = true;
    }
    /// Returns the errors that the last call of solve() has left, at its last iteration. If there was no iteration, or
    /// if constraints were added or removed since then, returns no errors.
    /// \param threads  number of threads; 0: the number that thread_count() returns
    ConstraintErrors errors(int threads = 0) const {
        ConstraintErrors sum;
        if (!is_solved_) return sum;
        std::vector<ConstraintErrors> parts((size() + detail::at_once - 1) / detail::at_once);
        detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            parts[first / detail::at_once] = solver_.errors_of(all_, first, last);
        });
        for (const ConstraintErrors& part : parts) sum.add(part);
        return sum;
    }

    /// Moves points that are at rest until the call, so that the length of each constraint approaches its length at
    /// rest.
    /// \param position  position of each point [m], changed in place; the other parameters are those of solve() above
    /// \throws parameter_error  if solve() above throws it
    void solve(std::span<Place> position, std::span<const S> inverse_mass, double dt, int iterations, int threads) {
        std::vector<Vec<S, D>> moved(position.size(), Vec<S, D>::zero());
        solve(position, moved, inverse_mass, dt, iterations, threads);
        for (std::size_t i = 0; i < moved.size(); ++i) position[i] += cast<double>(moved[i]);
    }

    /// Removes the constraints that tear, and those that have lost their support. ParticleSystem::tear says which these
    /// are.
    /// \param position  position of each point [m]
    /// \return the indices of the two end points of each removed constraint
    std::vector<Torn> torn(std::span<const Place> position) {
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
    bool is_overlong(std::span<const Place> position, int threads) const {
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
        ordered_ = are_counted_ = false;
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
    struct Origin {
        std::uint32_t number = 0;  // index in the order in which constraints were added
        LinkKind kind = LinkKind::stretch;
        std::uint8_t colour = 0;
    };

    /// Does one iteration of ConstraintUpdate::immediate or coloured.
    void iterate(int threads) {
        if (update == ConstraintUpdate::immediate) return solver_.correct(0, size());
        // The constraints of one colour are split into pieces that run in parallel. Constraints without a colour run
        // one by one.
        std::vector<std::size_t> counts(colour_end_.size());
        for (std::size_t c = 0; c < counts.size(); ++c)
            counts[c] = is_serial(c) ? 1 : (colour_end_[c] - colour_begin(c) + detail::at_once - 1) / detail::at_once;
        parallel_phases(counts, thread_count(threads), [&](std::size_t c, std::size_t piece, int) {
            const std::size_t begin = colour_begin(c) + piece * detail::at_once;
            if (is_serial(c))
                solver_.correct(begin, colour_end_[c]);
            else
                solver_.correct_apart(begin, std::min(begin + detail::at_once, colour_end_[c]));
        });
    }

    /// Does one iteration of ConstraintUpdate::averaged. Each correction is divided by a count n. To get n, count the
    /// constraints at each of the two end points; n is the larger count. The division conserves momentum, and it keeps
    /// the sum of the corrections at a point from becoming too large.
    void average(std::span<const S> inverse_mass, int threads) {
        renew(impulses_, size(), thread_count(threads));
        detail::for_chunks(size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t k = first; k < last; ++k) impulses_[k] = solver_.impulse_of(k, 1 / solver_.links(k));
        });
        detail::for_chunks(inverse_mass.size(), threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                Vec<S, D> sum = Vec<S, D>::zero();
                for (const std::uint32_t corner : incidence_.of(i))
                    sum += corner % 2 == 0 ? -impulses_[corner / 2] : impulses_[corner / 2];
                solver_.move_point(i, sum * inverse_mass[i]);
            }
        });
    }

    std::size_t colour_begin(std::size_t c) const { return c == 0 ? 0 : colour_end_[c - 1]; }
    bool is_serial(std::size_t c) const { return origin_[colour_begin(c)].colour == detail::LinkColours::most; }

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
            if (update == ConstraintUpdate::coloured) order_by_colours(detail::LinkColours(all_ends(), points).colour);
            ordered_ = true;
            ordered_for_ = update;
            are_counted_ = false;
            incidence_.clear();
            find_colours();
        }
        if (!are_counted_) solver_.count(all_, points);
        are_counted_ = true;
        if (update == ConstraintUpdate::averaged && !incidence_.is_for(points)) {
            const std::vector<Ends> ends = all_ends();
            incidence_ = detail::Incidence(std::span<const Ends>(ends), points);
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
        permute(all_), permute(origin_);
        solver_.permute(order);
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
                solver_.move(k, to);
                factors_.move(k, to);
                origin_[to++] = origin_[k];
            }
        if (to == size()) return;
        all_.resize(to);
        solver_.shrink(to);
        factors_.shrink(to);
        origin_.resize(to);
        are_counted_ = is_solved_ = false;
        incidence_.clear();
        find_colours();
    }

    std::vector<Constraint> all_;
    detail::LinkSolver<S, D> solver_;
    std::vector<Origin> origin_;
    detail::TearFactors<S> factors_;
    Digest as_added_;
    std::vector<std::size_t> colour_end_;
    detail::Incidence incidence_;
    aligned_vector<Vec<S, D>> impulses_;  // one per constraint, for ConstraintUpdate::averaged
    std::uint32_t added_ = 0;
    bool ordered_ = false, are_counted_ = false, is_solved_ = false;
    std::size_t checked_for_ = 0;  // number of points when the constraints' point indices were last checked
    ConstraintUpdate ordered_for_ = ConstraintUpdate::coloured;
};

}  // namespace firn::inline FIRN_BUILD
