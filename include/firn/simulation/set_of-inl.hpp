/// \file Bodies of set_of.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/simulation/set_of.hpp>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
[[gnu::cold]] SetOf<S, D>::SetOf() = default;
template <std::floating_point S, int D>
[[gnu::cold]] SetOf<S, D>::SetOf(const SetOf&) = default;
template <std::floating_point S, int D>
[[gnu::cold]] SetOf<S, D>::SetOf(SetOf&&) noexcept = default;
template <std::floating_point S, int D>
[[gnu::cold]] SetOf<S, D>& SetOf<S, D>::operator=(const SetOf&) = default;
template <std::floating_point S, int D>
[[gnu::cold]] SetOf<S, D>& SetOf<S, D>::operator=(SetOf&&) noexcept = default;
template <std::floating_point S, int D>
[[gnu::cold]] SetOf<S, D>::~SetOf() = default;

template <std::floating_point S, int D>
[[gnu::cold]] Body SetOf<S, D>::add(const Samples<D>& samples, double density, const Vec<double, D>& velocity,
                                    int threads, const Share& share) {
    const std::size_t n = samples.positions.size();
    return add(samples, density, velocity, threads, {share.first(n), share.last(n), 0, n});
}

template <std::floating_point S, int D>
[[gnu::cold]] Body SetOf<S, D>::add(const Samples<D>& samples, double density, const Vec<double, D>& velocity,
                                    int threads, const PartOfBody& part) {
    if (!(density > 0) || !std::isfinite(density))
        throw parameter_error(sentence("The density is ", density, " kg/m^3; it must be positive and finite."));
    if (!(samples.volume > 0) || !std::isfinite(samples.volume))
        throw parameter_error(
            sentence("The volume of a particle is ", samples.volume, " m^", D, "; it must be positive and finite."));
    const S volume = S(samples.volume), mass = S(density * samples.volume);
    if (!(volume > 0) || !(mass > 0) || !std::isfinite(volume) || !std::isfinite(mass))
        throw parameter_error(sentence("A particle of ", samples.volume, " m^", D, " and ", density * samples.volume,
                                       " kg is too small or too large for the simulation's precision. Use "
                                       "double."));
    return add_all(samples.positions, velocity, volume, {&mass, 1}, threads, part);
}

template <std::floating_point S, int D>
[[gnu::cold]] Body SetOf<S, D>::add(const Net<D>& net, std::span<const double> masses, const Vec<double, D>& velocity,
                                    int threads) {
    if (masses.size() != net.positions.size())
        throw parameter_error(sentence("A net of ", net.positions.size(), " points is given ", masses.size(),
                                       " masses; give one for each."));
    for (std::size_t i = 0; i < masses.size(); ++i)
        if (!(S(masses[i]) > 0) || !std::isfinite(S(masses[i])))
            throw parameter_error(
                sentence("The mass of point ", i, " is ", masses[i], " kg; it must be positive and finite."));
    for (const Facet<D>& facet : net.facets)
        for (const std::uint32_t corner : facet)
            if (corner >= masses.size())
                throw parameter_error(sentence("A facet of the net has the corner ", corner, "; there are ",
                                               masses.size(), " points, counted from 0."));
    const std::size_t n = masses.size();
    const std::vector<S> rounded(masses.begin(), masses.end());
    const Body body = add_all(net.positions, velocity, S(0), rounded, threads, {0, n, 0, n});
    for (Facet<D> facet : net.facets) {
        for (std::uint32_t& corner : facet) corner += body.first;
        facets.push_back(facet);
    }
    return body;
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::add(Source<D> source, const Moment& now) {
    if (now.steps > 0) source.skip(now.time);
    sources.push_back(std::move(source));
}

template <std::floating_point S, int D>
[[gnu::cold]] std::uint32_t SetOf<S, D>::add(Load<D> load) {
    if (!load.force) throw parameter_error("A load is an empty function; give one that returns a force.");
    check_body(load.body);
    return loads.template made<detail::Loads<S, D>>().add(std::move(load));
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::remove_load(std::uint32_t number) {
    if (!loads || !loads.template made<detail::Loads<S, D>>().remove(number))
        throw parameter_error(sentence("There is no load ", number,
                                       " of this material: it was removed already, or is another material's. Give "
                                       "what add_load() has returned."));
}

template <std::floating_point S, int D>
[[gnu::cold]] std::size_t SetOf<S, D>::body_of(std::uint32_t id) const {
    const auto next = std::upper_bound(bodies.begin(), bodies.end(), id,
                                       [](std::uint32_t wanted, const Body& body) { return wanted < body.first; });
    return next == bodies.begin() ? bodies.size() : std::size_t(next - bodies.begin()) - 1;
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::check_body(const Body& body) const {
    if (std::uint64_t(body.first) + body.count > store().next_id())
        throw parameter_error(sentence("There is no body of the particles ", body.first, " to ",
                                       std::uint64_t(body.first) + body.count - 1, ": ", store().next_id(),
                                       " ids of this material have been given out, counted from 0. Give the body "
                                       "that add() has returned for this material."));
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::hand_over(SetOf& stored, const Moment& moment) {
    stored.sources = std::move(sources);
    stored.sinks = std::move(sinks);
    stored.loads = std::move(loads);
    stored.forces = std::move(forces);
    if (stored.forces) stored.forces->forget();
    stored.facets = std::move(facets);
    stored.restored = moment;
    for (Source<D>& source : stored.sources) source.skip(moment.time);
}

template <std::floating_point S, int D>
void SetOf<S, D>::check_positions() {
    const ParticleStore<S, D>& particles = store();
    if (!readiness.is(Readiness::inside))
        firn::check_positions<double, D, S>(
            particles.slots(), particles.domain(), [&](std::size_t i, int a) { return particles.exact_position(i)[a]; },
            [&](std::size_t i) { return particles.id(i); });
    readiness.check();
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::move_to_group(const Body& body, int group) {
    ParticleStore<S, D>& particles = store();
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot) && body.holds(particles.id(slot))) particles.set_contact_group(slot, group);
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::set_contact_group(const Body& body, int group) {
    check_body(body);
    const int most = most_contact_groups(store().domain());
    if (group < 0 || group >= most)
        throw parameter_error(sentence("A body is put into contact group ", group,
                                       "; in this domain there are groups 0 to ", most - 1, "."));
    if (body.count == 0)
        throw parameter_error(sentence("A body without particles is put into contact group ", group,
                                       ". Give the body that add() has returned."));
    readiness.edit();
    move_to_group(body, group);
    for (Body& of : bodies)
        if (of.first >= body.first && of.first - body.first < body.count) of.contact_group = group;
}

template <std::floating_point S, int D>
[[gnu::cold]] void SetOf<S, D>::give(double time, int threads, const Share& share) {
    for (Source<D>& source : sources) {
        source.require_ids(time, no_particle - store().next_id());
        for (; source.is_due(time); ++source.bursts) {
            Samples<D> burst = source.samples;
            const double born = source.time_of(source.bursts);
            for (Vec<double, D>& x : burst.positions) x += source.velocity * (time - born);
            const Body body = add(burst, source.density, source.velocity, threads, share);
            if (!sinks.empty())
                remove_if([&](const Vec<double, D>&, std::uint32_t id) {
                    const std::size_t i = id - body.first;
                    return id >= body.first && is_taken(source.samples.positions[i], burst.positions[i]);
                });
            bodies.back().end = born + source.lifespan;
            if (source.contact_group != 0) set_contact_group(bodies.back(), source.contact_group);
        }
    }
}

template <std::floating_point S, int D>
void SetOf<S, D>::take(double time) {
    if (!may_take(time)) return;
    ParticleStore<S, D>& particles = store();
    const std::size_t before = particles.size();
    for (std::size_t slot = 0; slot < particles.used_slots(); ++slot)
        if (particles.is_particle(slot) && takes(slot, time)) particles.remove(slot);
    if (particles.size() < before) readiness.unprepare();
    for (Body& body : bodies)
        if (has_ended(body, time)) body.count = 0;
}

template <std::floating_point S, int D>
bool SetOf<S, D>::will_take(double time) const {
    const ParticleStore<S, D>& particles = store();
    for (std::size_t slot = 0; may_take(time) && slot < particles.used_slots(); ++slot)
        if (particles.is_particle(slot) && takes(slot, time)) return true;
    return false;
}

template <std::floating_point S, int D>
double SetOf<S, D>::next_burst() const {
    double next = std::numeric_limits<double>::infinity();
    for (const Source<D>& source : sources)
        if (const double due = source.time_of(source.bursts); due <= source.end) next = std::min(next, due);
    return next;
}

template <std::floating_point S, int D>
void SetOf<S, D>::push(const Moment& now, double dt, bool in_float, int threads, const detail::SumsOfSet<D>& sums) {
    ParticleStore<S, D>& particles = store();
    places_before.resize(sinks.empty() ? 0 : particles.used_slots());
    for (std::size_t slot = 0; slot < places_before.size(); ++slot) places_before[slot] = particles.place(slot);
    if (!loads && !forces) return;
    readiness.spoil();  // the particles cannot be used until the step has ended
    if (loads) loads->push(particles, now, dt, in_float, threads, sums);
    if (loads && forces) forces->forget();
    if (forces) forces->push(particles, now, dt, in_float, threads, sums);
}

template <std::floating_point S, int D>
void SetOf<S, D>::forget_pushes() {
    if (loads) loads->forget();
    if (forces) forces->forget();
}

template <std::floating_point S, int D>
bool SetOf<S, D>::may_take(double time) const {
    return !sinks.empty() ||
           std::any_of(bodies.begin(), bodies.end(), [&](const Body& body) { return has_ended(body, time); });
}

template <std::floating_point S, int D>
bool SetOf<S, D>::takes(std::size_t slot, double time) const {
    const ParticleStore<S, D>& particles = store();
    if (slot < places_before.size()) {
        const Vec<double, D> to = particles.exact_position(slot);
        const Vec<S, D> way = particles.place(slot) - places_before[slot];  // [cells]
        if (is_taken(to - cast<double>(way) * particles.domain().cell_size, to)) return true;
    }
    const std::size_t b = body_of(particles.id(slot));
    return b < bodies.size() && has_ended(bodies[b], time);
}

template <std::floating_point S, int D>
[[gnu::cold]] bool SetOf<S, D>::is_taken(const Vec<double, D>& from, const Vec<double, D>& to) const {
    const Domain<D>& domain = store().domain();
    // Each bit of `images` chooses, for an axis, the way at the end where the particle has left.
    for (unsigned images = 0; images < 1u << D; ++images) {
        Vec<double, D> shift{};
        bool is_image = true;
        for (int a = 0; a < D; ++a) {
            if ((images >> a & 1u) == 0) continue;
            const double extent = domain.upper[a] - domain.lower[a];
            shift[a] = from[a] < domain.lower[a] ? extent : from[a] > domain.upper[a] ? -extent : 0;
            is_image = is_image && domain.periodic[std::size_t(a)] && shift[a] != 0;
        }
        if (is_image && std::any_of(sinks.begin(), sinks.end(),
                                    [&](const Sink<D>& sink) { return sink.is_on_the_way(from + shift, to + shift); }))
            return true;
    }
    return false;
}

template <std::floating_point S, int D>
Body SetOf<S, D>::add_all(const std::vector<Vec<double, D>>& x, const Vec<double, D>& velocity, S volume,
                          std::span<const S> masses, int threads, const PartOfBody& part) {
    ParticleStore<S, D>& particles = store();
    for (int a = 0; a < D; ++a)
        if (!std::isfinite(S(velocity[a])))
            throw parameter_error(sentence("Component ", a, " of the velocity is ", velocity[a],
                                           " m/s; it must be finite in the simulation's precision."));
    if (!x.empty() || part.count == 0)
        firn::check_positions<double, D, S>(x.size(), particles.domain(),
                                            [&](std::size_t i, int a) { return x[i][a]; });
    if (part.count > particles.ids_left())
        throw parameter_error(sentence("A body of ", part.count, " particles: only ", particles.ids_left(),
                                       " ids of this material are left."));
    const Body body{store().next_id(), std::uint32_t(part.count)};
    particles.reserve(particles.size() + (part.end - part.begin), threads);
    particles.skip_ids(body.first + std::uint32_t(part.before + part.begin));
    for (std::size_t i = part.begin; i < part.end; ++i) {
        const std::size_t slot = particles.push_back(x[i]);
        particles.set_velocity(slot, cast<S>(velocity));
        particles.set_mass(slot, masses[masses.size() == 1 ? 0 : i]);
        particles.set_volume(slot, volume);
        start_state(slot);
    }
    particles.skip_ids(body.first + body.count);
    bodies.push_back(body);
    readiness.unprepare();
    return body;
}

}  // namespace firn::inline FIRN_BUILD
