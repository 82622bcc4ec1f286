/// \file Makes a state from a ParticleSystem, and restores a ParticleSystem from such a state. A run that is continued
/// from the state gives the same bits as an uninterrupted run.
#pragma once

#include <firn/core/names.hpp>
#include <firn/io/settings.hpp>
#include <firn/io/state_parts.hpp>
#include <firn/lagrangian/particle_system.hpp>
#include <firn/version.hpp>

#include <algorithm>
#include <bit>
#include <span>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Returns a state of point masses, for output, with the points in the order of their ids. The state has the positions
/// [m], rounded to S, all fields of the points whose values have type S (velocities [m/s], masses [kg], …), and a field
/// `pinned`, which is 1 for a pinned point and 0 for any other point. State::body has the group of each point. A run
/// cannot be continued from this state; for a state from which a run can be continued, call state_of() of the
/// ParticleSystem.
/// \param points  the points
/// \param facets  triangles (edges in 2D), each given by the indices of its corners in `points`, from 0
/// \param time    time of the state [s]
/// \param step    number of steps since the start of the run
/// \throws parameter_error  if a facet names a point that does not exist
template <std::floating_point S, int D>
State<S> state_of(const PointMasses<S, D>& points, std::type_identity_t<std::span<const Facet<D>>> facets, double time,
                  std::uint64_t step) {
    const std::size_t n = points.size();
    State<S> state;
    state.dimension = D;
    state.step = step;
    state.time = time;
    StateField<S> position{"position", "m", D, {}};
    position.values.reserve(n * D);
    for (const Vec<double, D>& x : points.position)
        for (int a = 0; a < D; ++a) position.values.push_back(S(x[a]));
    state.fields.push_back(std::move(position));
    PointMasses<S, D>::for_fields([&](const FieldInfo& info, auto member) {
        if (info.number != FieldNumber::real) return;
        const auto* const first = reinterpret_cast<const S*>((points.*member).data());
        const int components = info.components(D);
        state.fields.push_back({info.name, info.unit, components, {first, first + n * std::size_t(components)}});
    });
    StateField<S> pinned{"pinned", "1", 1, std::vector<S>(n)};
    for (std::size_t i = 0; i < n; ++i) pinned.values[i] = points.is_pinned(i) ? S(1) : S(0);
    state.fields.push_back(std::move(pinned));
    state.id.assign(points.id.begin(), points.id.end());
    state.body.reserve(n);
    for (const auto group : points.group) state.body.push_back(std::int32_t(group));
    state.facets.reserve(facets.size() * D);
    for (const auto& facet : facets) state.facets.insert(state.facets.end(), facet.begin(), facet.end());
    state.attributes = {{"precision", detail::precision_name<S>}, {"library_version", version()}};
    check_state(state);
    return state;
}

namespace detail {

/// Converts N numbers of type S to 64-bit integers and back. Each integer contains the bits of one double or of two
/// floats (the first float in the upper 32 bits).
template <std::floating_point S, std::size_t N>
struct WholeNumbers {
    static constexpr std::size_t each = sizeof(std::int64_t) / sizeof(S);
    static constexpr std::size_t count = (N + each - 1) / each;
    using Bits = std::conditional_t<each == 1, std::uint64_t, std::uint32_t>;

    static std::array<std::int64_t, count> of(const std::array<S, N>& numbers) {
        std::array<std::int64_t, count> all{};
        for (std::size_t k = 0; k < N; ++k) all[k / each] |= std::int64_t(wide(numbers[k]) << shift(k));
        return all;
    }
    static std::array<S, N> back(const std::int64_t* all) {
        std::array<S, N> numbers;
        for (std::size_t k = 0; k < N; ++k)
            numbers[k] = std::bit_cast<S>(Bits(std::uint64_t(all[k / each]) >> shift(k)));
        return numbers;
    }

private:
    static std::uint64_t wide(S number) { return std::bit_cast<Bits>(number); }
    static constexpr int shift(std::size_t k) { return each == 1 || k % 2 == 1 ? 0 : 32; }
};

/// Returns three attributes of a run: the name of the integrator, the name of the boundary, and the precision. The run
/// can be continued from a state only if the state has the same values of these attributes.
template <class S, class Integrator, class Boundary>
std::vector<StateAttribute> system_attributes() {
    return {{"integrator", std::string(name_of<Integrator>())},
            {"boundary", std::string(name_of<Boundary>())},
            {"precision", precision_name<S>}};
}

/// The table with the positions of points in double, of which the field of this name has the rounded values.
inline constexpr const char* position_table = "position";

/// Returns what shapes a run besides the parameters in its states. \see Settings
///
/// Constraints, elements and emitters are told as they were added. What a program may change from step to step, such as
/// the wind of a drag or a tear factor of all, is left out.
template <int D, std::floating_point S, class Integrator, class Boundary>
Settings settings_of(const ParticleSystem<D, S, Integrator, Boundary>& system) {
    Settings settings;
    settings.add("boundary", system.boundary);
    settings.add(sentence(system.constraints.history().added,
                          system.constraints.update == ConstraintUpdate::averaged ? " averaged" : "",
                          " constraints: ", digest_text(system.constraints.digest())));
    if (const auto& of = system.collisions)
        settings.add(sentence("collisions: restitution ", exact_text(of->restitution), ", friction ",
                              exact_text(of->friction), ", passes ", of->velocity_passes, " and ", of->shift_passes,
                              of->remember ? ", remembered" : ""));
    for (const std::uint64_t digest : system.digests_of_forces()) settings.add("force: " + digest_text(digest));
    for (const Emitter<D>& of : system.emitters()) {
        Digest all;
        all.add(of.position).add(of.direction).add(of.nozzle).add(of.speed).add(of.speed_spread).add(of.cone);
        all.add(of.lifespan).add(of.lifespan_spread).add(of.mass).add(of.radius).add(of.group).add(of.maximum);
        settings.add(sentence("emitter: rate ", exact_text(of.rate), " 1/s from ", exact_text(of.start), " s to ",
                              exact_text(of.end), " s, seed ", of.seed, ", ", digest_text(all.value())));
    }
    return settings;
}

inline constexpr std::size_t colours_at_once = sizeof(std::int64_t);

/// Reader of a particle system's state. It checks all values that it reads.
template <std::floating_point S, int D>
class SystemReader {
public:
    explicit SystemReader(const State<S>& state) : state_(state), next_id_(whole("next_id", double(no_particle))) {}

    SystemMoment<S, D> moment() const {
        SystemMoment<S, D> moment;
        moment.points = points();
        moment.constraints.added = whole("constraints", double(no_particle));
        moment.now = {state_.time, state_.step, state_.last_time_step};
        const auto& facets = state_.facets;
        for (std::size_t row = 0; row < facets.size(); row += D) {
            Facet<D> facet;
            for (std::size_t k = 0; k < std::size_t(D); ++k) facet[k] = std::uint32_t(facets[row + k]);
            moment.facets.push_back(facet);
        }
        const std::int64_t n = std::int64_t(state_.size());
        for_rows("torn", 2, [&](const std::int64_t* row) {
            moment.torn.push_back({index(row[0], n, "torn"), index(row[1], n, "torn")});
        });
        const std::int64_t added = moment.constraints.added;
        for_rows("constraints_gone", 1, [&](const std::int64_t* row) {
            moment.constraints.gone.push_back(index(row[0], added, "constraints_gone"));
        });
        read_colours(moment.constraints);
        read_emitters(moment.emitters);
        if (whole("impulses", 1) == 1) moment.impulses.emplace();
        for_rows("impulses", 1 + int(Numbers::count), [&](const std::int64_t* row) {
            const auto ids = std::bit_cast<std::uint64_t>(row[0]);
            if (!moment.impulses || ids >> 32 >= next_id_) throw damaged("impulses");
            moment.impulses->push_back({{std::uint32_t(ids >> 32), std::uint32_t(ids)}, Numbers::back(row + 1)});
        });
        return moment;
    }

    /// Returns the value of a parameter in the group "system"; the parameter must have exactly one value.
    /// \throws io_error  if the state has no such parameter, if the parameter has several values, or if the value is
    ///                   not within [least, most]
    double number(const char* name, double least, double most) const {
        return checked(name, parameter_values(state_, "system", name), 1, least, most)[0];
    }
    std::uint32_t whole(const char* name, double most) const {
        const double value = number(name, 0, most);
        if (value != std::floor(value)) throw damaged(name);
        return std::uint32_t(value);
    }
    Vec<double, D> vector(const char* name) const {
        Vec<double, D> value{};
        const double most = std::numeric_limits<double>::max();
        std::ranges::copy(checked(name, parameter_values(state_, "system", name), D, -most, most), value.v);
        return value;
    }

    static io_error damaged(const std::string& what) {
        return io_error(
            sentence("The state's '", what, "' is invalid, so no run can go on from it. Go on from another state."));
    }

private:
    using Numbers = WholeNumbers<S, std::size_t(D) + 1>;

    static std::vector<double> checked(const char* name, std::vector<double> values, std::size_t count, double least,
                                       double most) {
        const auto wrong = [&](double value) { return !(value >= least && value <= most); };
        if (values.size() != count || std::ranges::any_of(values, wrong)) throw damaged(name);
        return values;
    }
    static std::uint32_t index(std::int64_t given, std::int64_t count, const char* what) {
        if (given < 0 || given >= count) throw damaged(what);
        return std::uint32_t(given);
    }
    /// Calls f(row) for each row of a table. The argument `row` is a pointer to the first integer of the row.
    template <class F>
    void for_rows(const char* name, int columns, const F& f) const {
        const StateTable& rows = table(state_.tables, name, columns);
        for (std::size_t k = 0; k < rows.values.size(); k += std::size_t(columns)) f(rows.values.data() + k);
    }

    /// Returns the values of a field of the state, point by point.
    /// \throws io_error  if the state has no field with the name and the number of components in `info`, or if a value
    ///                   is not finite or not allowed by `info`
    std::span<const S> field(const FieldInfo& info) const {
        const StateField<S>* const found = state_.find(info.name);
        if (!found || found->components != info.components(D))
            throw io_error(sentence("The state has no field '", info.name, "' of ", info.components(D),
                                    " components; write all fields for a run to go on."));
        for (const S value : found->values)
            if (!std::isfinite(value) || !info.allows(double(value))) throw damaged(info.name);
        return found->values;
    }

    PointMasses<S, D> points() const {
        const std::size_t n = state_.size();
        const StateTable& end = table(state_.tables, "end", 1);
        if (end.values.size() != n) throw damaged("end");
        PointMasses<S, D> points;
        points.reserve(n);
        for (std::size_t i = 0; i < n; ++i) {
            const std::int64_t id = state_.id[i];
            if (id < 0 || id >= std::int64_t(next_id_) || (i > 0 && id <= state_.id[i - 1])) throw damaged("id");
            points.append(std::uint32_t(id));
            points.group[i] = std::uint32_t(state_.body[i]);
            points.end[i] = time(end.values[i]);
        }
        PointMasses<S, D>::for_fields([&](const FieldInfo& info, auto member) {
            if (info.number != FieldNumber::real) return;
            std::ranges::copy(field(info), reinterpret_cast<S*>((points.*member).data()));
        });
        read_positions(points);
        points.skip_ids(next_id_);
        return points;
    }
    /// Reads the positions: from the table of doubles, or from the field if the state has no such table, because S is
    /// double or the state was written by an earlier firn.
    void read_positions(PointMasses<S, D>& points) const {
        const std::span<const S> rounded = field({"position", "m", FieldShape::vector, FieldRole::motion});
        const bool is_exact =
            std::ranges::any_of(state_.tables, [](const StateTable& each) { return each.name == position_table; });
        const std::int64_t* const exact = is_exact ? table(state_.tables, position_table, D).values.data() : nullptr;
        if (is_exact && table(state_.tables, position_table, D).values.size() != rounded.size())
            throw damaged("position");
        for (std::size_t k = 0; k < rounded.size(); ++k) {
            const double x = exact ? std::bit_cast<double>(exact[k]) : double(rounded[k]);
            if (!(S(x) == rounded[k])) throw damaged("position");
            points.position[k / D][int(k % D)] = x;
        }
    }
    /// Returns the time [s] that the integer `bits` stands for: the double with the same bits.
    /// \throws io_error  if the double is NaN
    static double time(std::int64_t bits) {
        const double value = std::bit_cast<double>(bits);
        if (std::isnan(value)) throw damaged("end");
        return value;
    }

    void read_colours(ConstraintHistory& history) const {
        const auto& packed = table(state_.tables, "constraint_colours", 1).values;
        if (packed.empty()) return;
        const std::size_t left = history.added - std::min<std::size_t>(history.added, history.gone.size());
        if (packed.size() != (left + colours_at_once - 1) / colours_at_once) throw damaged("constraint_colours");
        for (std::size_t k = 0; k < left; ++k)
            history.colours.push_back(
                std::uint8_t(std::uint64_t(packed[k / colours_at_once]) >> 8 * (k % colours_at_once)));
    }

    void read_emitters(std::vector<EmitterHistory>& emitters) const {
        const StateTable& children = table(state_.tables, "emitted", 2);
        std::size_t read = 0;
        for_rows("emitters", 2, [&](const std::int64_t* row) {
            emitters.push_back({std::bit_cast<std::uint64_t>(row[0]), {}});
            const std::size_t last =
                read + 2 * index(row[1], std::int64_t((children.values.size() - read) / 2) + 1, "emitters");
            for (; read < last; read += 2)
                emitters.back().children.push_back(
                    {index(children.values[read], next_id_, "emitted"), time(children.values[read + 1])});
        });
        if (read != children.values.size()) throw damaged("emitted");
    }

    const State<S>& state_;
    std::uint32_t next_id_;
};

}  // namespace detail

/// Returns the current state of a particle system. The state has everything that is needed to continue the run: the
/// points and facets, the positions in double (a table `position`; the field has them rounded to S), the times at which
/// points are removed, torn links, the number of births and the living particles of each emitter, contact impulses,
/// gravity [m/s²], damping [1/s], the number of iterations, the coefficient of restitution, the parameters of the
/// boundary, and the names of the integrator and the boundary.
/// \throws particle_error  if the position or velocity of a point is not finite; the message names the first such point
template <int D, std::floating_point S, class Integrator, class Boundary>
State<S> state_of(const ParticleSystem<D, S, Integrator, Boundary>& system) {
    const PointMasses<S, D>& points = system.points;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!detail::is_finite(points.position[i]) || !detail::is_finite(points.velocity[i]))
            throw particle_error(sentence("Point ", points.id[i], " is at ", detail::describe(points.position[i]),
                                          " m and has velocity ", detail::describe(points.velocity[i]), " m/s at step ",
                                          system.steps(),
                                          "; no run can go on from there. Go on from the state before."));
    State<S> state = state_of(points, system.facets, system.time(), system.steps());
    state.last_time_step = system.last_time_step();
    state.attributes = detail::system_attributes<S, Integrator, Boundary>();
    if constexpr (requires { system.boundary.description(); })
        state.attributes.push_back({"boundary_conditions", system.boundary.description()});
    for (StateAttribute& attribute : detail::build_attributes()) state.attributes.push_back(std::move(attribute));
    state.attributes.push_back(detail::settings_of(system).attribute(detail::settings_name));

    for_parameters(system.boundary, [&](const std::string& name, const char* unit, const auto& value) {
        state.parameters.push_back({"boundary", name, unit, detail::as_doubles(value)});
    });
    const auto parameter = [&](const char* name, const char* unit, std::vector<double> values) {
        state.parameters.push_back({"system", name, unit, std::move(values)});
    };
    const ConstraintHistory constraints = system.constraints.history();
    const auto kept = system.collisions ? system.collisions->kept() : std::nullopt;
    parameter("gravity", "m/s^2", detail::as_doubles(system.gravity));
    parameter("damping", "1/s", {system.damping});
    parameter("iterations", "1", {double(system.iterations)});
    parameter("restitution", "1", {system.restitution});
    parameter("next_id", "1", {double(points.next_id())});
    parameter("constraints", "1", {double(constraints.added)});
    parameter("impulses", "1", {kept ? 1.0 : 0.0});

    const std::vector<std::uint8_t>& colours = constraints.colours;
    StateTable packed{"constraint_colours", 1, {}};
    packed.values.resize((colours.size() + detail::colours_at_once - 1) / detail::colours_at_once);
    for (std::size_t k = 0; k < colours.size(); ++k)
        packed.values[k / detail::colours_at_once] |=
            std::int64_t(std::uint64_t(colours[k]) << 8 * (k % detail::colours_at_once));
    StateTable gone{"constraints_gone", 1, {constraints.gone.begin(), constraints.gone.end()}};
    // The table `emitted` has one row for each of the emitters' particles: the particle's id, and the time at which the
    // particle is removed (bits of the double). The table `emitters` has one row for each emitter: its number of
    // births, and its number of rows in `emitted`.
    StateTable emitted{"emitted", 2, {}}, emitters{"emitters", 2, {}};
    for (const Emitter<D>& emitter : system.emitters()) {
        emitters.values.insert(emitters.values.end(),
                               {std::bit_cast<std::int64_t>(emitter.births), std::int64_t(emitter.children.size())});
        for (const EmittedChild& child : emitter.children)
            emitted.values.insert(emitted.values.end(), {child.id, std::bit_cast<std::int64_t>(child.end)});
    }
    StateTable end{"end", 1, {}};
    for (const double each : points.end) end.values.push_back(std::bit_cast<std::int64_t>(each));
    StateTable torn{"torn", 2, {}};
    for (const Torn& ends : system.torn()) torn.values.insert(torn.values.end(), ends.begin(), ends.end());
    using Numbers = detail::WholeNumbers<S, std::size_t(D) + 1>;
    // First column: the ids of the two points, 32 bits each. Other columns: the bits of KeptImpulse::numbers.
    StateTable impulses{"impulses", 1 + int(Numbers::count), {}};
    if (kept)
        for (const KeptImpulse<S, D>& each : *kept) {
            impulses.values.push_back(std::bit_cast<std::int64_t>(std::uint64_t(each.ids[0]) << 32 | each.ids[1]));
            const auto numbers = Numbers::of(each.numbers);
            impulses.values.insert(impulses.values.end(), numbers.begin(), numbers.end());
        }
    state.tables = {std::move(packed), std::move(gone),     std::move(emitted), std::move(emitters),
                    std::move(end),    std::move(impulses), std::move(torn)};
    if constexpr (!std::same_as<S, double>) {
        StateTable position{detail::position_table, D, {}};  // the bits of the doubles
        for (const Vec<double, D>& x : points.position)
            for (int a = 0; a < D; ++a) position.values.push_back(std::bit_cast<std::int64_t>(x[a]));
        state.tables.push_back(std::move(position));
    }
    return state;
}

/// Restores a particle system from a state, so that the run can be continued. With Restart::same_bits, the continued
/// run gives the same bits as the run that wrote the state, for any number of threads.
///
/// First make the system in the same way as for the run that wrote the state, but take no step. Add the same points,
/// forces, constraints, excluded pairs and emitters in the same order. If `collisions` was set in that run, set it,
/// too.
///
/// restore() takes from the state: the points and facets, torn links, the number of births and the living particles of
/// each emitter, contact impulses, time, number of steps, gravity, damping, the number of iterations, the coefficient
/// of restitution and the parameters of the boundary. Everything else in the system is not changed.
/// \param system  the system that is restored
/// \param state   the state, such as read_state() returns
/// \param how     which states are accepted; Restart::converted is not supported
/// \throws io_error         if the state was written by a run with other policies, another number of dimensions or
///                          another build (see Restart), if a part of the state is missing or invalid (the message
///                          names this part), or if the system has taken a step. The system is then unchanged.
/// \throws parameter_error  if `how` is Restart::converted
template <int D, std::floating_point S, class Integrator, class Boundary>
void restore(ParticleSystem<D, S, Integrator, Boundary>& system, const std::type_identity_t<State<S>>& state,
             Restart how = Restart::same_bits) {
    if (how == Restart::converted)
        throw parameter_error(
            "A particle system goes on from its own states only; add the points of others with PointMasses::add.");
    detail::check_dimension(state, D);
    detail::check_same(state, detail::system_attributes<S, Integrator, Boundary>(),
                       "Go on with a system of the same policies and precision.");
    if (how == Restart::same_bits) {
        detail::check_same_build(state);
        const detail::Settings ours = detail::settings_of(system);
        detail::check_settings(state, ours.attribute(detail::settings_name),
                               "Make the system as for the run that wrote the state; change it after restore().");
        detail::warn_of_unseen(ours, system.warn);
    }
    try {
        check_state(state);
        const detail::SystemReader<S, D> reader(state);
        const Vec<double, D> gravity = reader.vector("gravity");
        const double damping = reader.number("damping", 0, std::numeric_limits<double>::max());
        const auto iterations = int(reader.whole("iterations", std::numeric_limits<int>::max()));
        const double restitution = reader.number("restitution", 0, 1);
        Boundary boundary = system.boundary;
        restore_parameters(boundary, state, "boundary");
        check_boundary(boundary);
        system.resume(reader.moment());
        system.gravity = gravity;
        system.damping = damping;
        system.iterations = iterations;
        system.restitution = restitution;
        system.boundary = std::move(boundary);
    } catch (const io_error&) {
        throw;
    } catch (const error& wrong) {
        throw io_error(sentence("The system cannot go on from the state. ", wrong.what()));
    }
}

}  // namespace firn::inline FIRN_BUILD
