/// \file Bodies of Adjoint: the way forward.
#pragma once

#include <firn/adjoint/adjoint.hpp>

namespace firn::inline FIRN_BUILD {

template <class Simulation>
Adjoint<Simulation>::Adjoint(Simulation& simulation, const AdjointOptions& options)
    : simulation_(simulation),
      memory_(options.memory),
      bar_grid_(simulation.domain()),
      bar_before_(simulation.domain()),
      before_walls_(simulation.domain()) {
    refuse_what_has_no_way_back();
    simulation_.prepare();
    moments_.push_back(simulation_.now_);
    sources_and_sinks_ = count_sources_and_sinks();
    on_disk_ = detail::states_on_disk(options.folder, options.disk, simulation_.sets_);
    const Room room = room_for_checkpoints();
    kept_ = std::make_unique<Checkpoints<Snapshot>>(room.in_memory, elsewhere(room));
    kept_->keep(0, [&](Snapshot& to) { store(to); });
    bars_.resize(simulation_.sets_.size());
    left_ = simulation_.boundary;
    if (const char* const where = detail::jump_of_policies<Kernel, Transfer, Force>(); where && simulation_.warn)
        simulation_.warn(
            sentence("Steps of this simulation jump ", where,
                     ". A gradient does not see a jump: compare it with differences, by Adjoint::check()."));
}

template <class Simulation>
std::size_t Adjoint<Simulation>::count_sources_and_sinks() const {
    std::size_t count = 0;
    for (const SetOf<S, D>& set : simulation_.sets_) count += set.sources.size() + set.sinks.size();
    return count;
}

template <class Simulation>
auto Adjoint<Simulation>::room_for_checkpoints() -> Room {
    std::size_t bytes = 0;
    const auto bytes_of = [](const auto& list) { return list.size() * sizeof(list[0]); };
    for (const SetOf<S, D>& set : simulation_.sets_) {
        bytes += set.store().bytes() + bytes_of(set.partition.order) + bytes_of(set.partition.ranges) +
                 bytes_of(set.partition.groups) + bytes_of(set.bodies) + bytes_of(set.places_before);
        for (const Source<D>& source : set.sources) bytes += bytes_of(source.samples.positions);
    }
    // Room for the nodes of the step, with a quarter more, because matter may spread.
    const std::size_t nodes = simulation_.grid_.block_count() * std::size_t(block_nodes<D> * node_width);
    room_for_nodes_ = std::max(room_for_nodes_, nodes * sizeof(S) * (blended ? 10 : 5) / 4);
    bytes += room_for_nodes_;
    bytes = std::max<std::size_t>(bytes, 1);
    std::size_t away = 0, of_those_away = 0;  // their number, and what they have in memory
    if (on_disk_ && memory_ > 3 * bytes) {
        const std::size_t of_each = sizeof(Snapshot) + on_disk_->bytes_in_memory(simulation_.sets_);
        away = std::min({on_disk_->most(simulation_.sets_), (memory_ - 3 * bytes) / of_each, std::size_t(1) << 20});
        of_those_away = away * of_each;
    }
    const std::size_t most = (memory_ - of_those_away) / bytes;
    if (most < 3)
        throw parameter_error(sentence("After ", moments_.size() - 1,
                                       " recorded steps, a checkpoint of this simulation takes ", bytes, " bytes, and ",
                                       memory_,
                                       " are granted; give the adjoint memory for three at least: two checkpoints, and "
                                       "the state at the end."));
    return {std::min<std::size_t>(most - 1, 1 << 20), away};
}

template <class Simulation>
auto Adjoint<Simulation>::elsewhere(const Room& room) -> Elsewhere<Snapshot> {
    if (!on_disk_) return {};
    return {room.on_disk,
            [this](Snapshot& state, Snapshot& memory) {
                if (!on_disk_->put(state.sets, state.on_disk, memory.sets)) return false;
                std::swap(memory.nodes, state.nodes);  // not written: P2G computes them again
                return true;
            },
            [this](Snapshot& state, Snapshot& memory) {
                on_disk_->bring(state.sets, state.on_disk, memory.sets);
                std::swap(memory.nodes, state.nodes);
                state.nodes.are_kept = false;
            }};
}

template <class Simulation>
bool Adjoint<Simulation>::prepare_again() {
    SetList<S, D>& sets = simulation_.sets_;
    bool is_ready = true;
    for (const SetOf<S, D>& set : sets) is_ready = is_ready && set.readiness.is(Readiness::prepared);
    if (is_ready) return false;
    if (detail::may_have_particles(sets, simulation_.ranks())) {
        simulation_.prepare();
        return true;
    }
    // The last particles have gone. The next step would be refused, but this is a state.
    for (SetOf<S, D>& set : sets) {
        set.partition = {};
        set.report = {};
        set.readiness.prepare();
    }
    simulation_.activate();
    return true;
}

template <class Simulation>
void Adjoint<Simulation>::refuse_what_has_no_way_back() const {
    for (const Pass<S, D>& pass : simulation_.passes()) {
        constexpr std::string_view known[] = {
            "sort", "push",           "p2g",     "grid update",      "average volumes",
            "g2p",  "restore masses", "end g2p", "sinks and sources"};
        const bool is_series = refines_velocities<Transfer> && pass.name == "refine velocities";
        if (!is_series && std::ranges::find(known, pass.name) == std::end(known))
            throw usage_error(sentence("The pass \"", pass.name,
                                       "\" of this simulation has no way back, so there are no derivatives through "
                                       "it. Choose another policy, or leave the pass out."));
    }
    for (const SetOf<S, D>& set : simulation_.sets())
        if (set.forces)
            throw usage_error(
                "This simulation has forces between particles. They have no way back: there are no derivatives through "
                "them.");
    detail::refuse_loads_of_doubles(simulation_.sets_);
    if (const char* const why = detail::no_motion_back(simulation_.boundary))
        throw usage_error(
            sentence("A collider of this simulation has no way back, so there are no derivatives through "
                     "it: ",
                     why, "."));
}

template <class Simulation>
void Adjoint<Simulation>::store(Snapshot& to) const {
    to.sets.resize(simulation_.sets_.size());
    auto& simulation = const_cast<Simulation&>(simulation_);
    simulation.for_materials([&]<class Set>(Set& set, std::size_t k) {
        if (to.sets[k])
            static_cast<Set&>(*to.sets[k]) = set;
        else
            to.sets[k] = set.copy();
    });
    store_moment(to);
}

template <class Simulation>
void Adjoint<Simulation>::keep_before_step(Snapshot& to) {
    const auto& sets = simulation_.sets_;
    // Loads change the velocities before G2P.
    bool leaves = to.sets.size() == sets.size();
    for (std::size_t k = 0; k < sets.size(); ++k) leaves = leaves && to.sets[k] && !sets[k].loads;
    if (!leaves) return store(to);
    simulation_.for_materials(
        [&]<class Set>(Set& set, std::size_t k) { detail::copy_without_fields(set, static_cast<Set&>(*to.sets[k])); });
    store_moment(to);
    leave_ = &to;
}

template <class Simulation>
void Adjoint<Simulation>::store_moment(Snapshot& to) const {
    to.now = simulation_.now_;
    to.boundary = simulation_.boundary;
    to.nodes.are_kept = false;
}

template <class Simulation>
void Adjoint<Simulation>::restore(const Snapshot& from) {
    simulation_.for_materials(
        [&]<class Set>(Set& set, std::size_t k) { set = static_cast<const Set&>(*from.sets[k]); });
    simulation_.now_ = from.now;
    simulation_.boundary = from.boundary;
    simulation_.activate();
}

template <class Simulation>
void Adjoint<Simulation>::swap_with(Snapshot& from) {
    simulation_.for_materials(
        [&]<class Set>(Set& set, std::size_t k) { std::swap(set, static_cast<Set&>(*from.sets[k])); });
    std::swap(nodes_, from.nodes);
    simulation_.now_ = from.now;
    simulation_.boundary = from.boundary;
    simulation_.activate();
}

template <class Simulation>
void Adjoint<Simulation>::require_as_left() const {
    const Moment& last = moments_.back();
    bool is_as_left = simulation_.now_ == last;
    for (const SetOf<S, D>& set : simulation_.sets_) is_as_left = is_as_left && set.readiness.is(Readiness::prepared);
    if (!is_as_left)
        throw usage_error(sentence("The simulation was advanced, or its particles were changed, after step ",
                                   last.steps,
                                   " without the adjoint, which cannot go back through that. Take steps "
                                   "with the adjoint's advance() and step(), and change particles before it is made."));
}

template <class Simulation>
template <class Acceleration, class Take>
void Adjoint<Simulation>::record(const Acceleration& acceleration, const Take& take) {
    require_as_left();
    refuse_what_has_no_way_back();
    if (count_sources_and_sinks() != sources_and_sinks_)
        throw usage_error(
            "A source or a sink was added after the adjoint was made, which cannot go back through that. Add it before "
            "the adjoint is made; a source may start later.");
    begin_interval(detail::own_acceleration<D>(acceleration));
    // A last pass of each step records it.
    struct Recording {
        Adjoint& of;
        PassList<S, D> passes = of.simulation_.passes_;
        ~Recording() {
            of.simulation_.passes_ = std::move(passes);
            of.left_ = of.simulation_.boundary;
        }
    } recording{*this};
    simulation_.add_pass("record", "sinks and sources", [this](Simulation&, const StepNow<S, D>& now) {
        // Where particles have come or gone, what the next step would do first is done now, so that a state is ready.
        std::optional<Room> room;
        if (prepare_again()) {
            for (std::size_t k = 0; k < simulation_.sets_.size(); ++k)
                if (simulation_.sets_[k].readiness.is(Readiness::sorted)) changes_.push_back({steps() + 1, k});
            room = room_for_checkpoints();
        }
        dts_.push_back(now.dt);
        moments_.push_back(simulation_.now_);
        repetitions_.push_back(0);
        std::exception_ptr failure;  // to write a checkpoint; the step is recorded all the same
        const auto attempt = [&](const auto& part) {
            try {
                part();
            } catch (...) {
                failure = std::current_exception();
            }
        };
        if (room) attempt([&] { kept_->lower_most(room->in_memory, room->on_disk); });
        attempt([&] { kept_->keep(steps(), [&](Snapshot& to) { store(to); }); });
        for (const auto& measure_again : each_step_) measure_again();
        if (failure) std::rethrow_exception(failure);
    });
    take();
    moments_.back() = simulation_.now_;  // advance() ends at its very end
}

template <class Simulation>
template <class Acceleration>
void Adjoint<Simulation>::begin_interval(const Acceleration& acceleration) {
    Interval next{};
    next.first = steps();
    next.gravity = simulation_.gravity;
    next.boundary = simulation_.boundary;
    next.carried = detail::TracedMotion(left_, 1).changed();
    const std::vector<double> before = detail::numbers_of(left_), now = detail::numbers_of(next.boundary);
    next.carried.resize(now.size());
    for (std::size_t k = 0; k < now.size(); ++k)
        next.carried[k] = next.carried[k] && k < before.size() && before[k] == now[k];
    next.transfer = simulation_.transfer;
    next.is_uniform = detail::is_uniform<Acceleration>;
    next.step = [this, acceleration](double dt, const auto* direction, double t) {
        auto changed = acceleration;
        if (direction) {
            [[maybe_unused]] std::size_t k = 0;
            if constexpr (detail::is_uniform<Acceleration>)
                changed += cast<std::remove_cvref_t<decltype(changed.v[0])>>(direction->gravity * t);
            else
                detail::for_reals(changed, [&](auto& number) {
                    number += std::remove_cvref_t<decltype(number)>(t * direction->acceleration.at(k++).second);
                });
        }
        simulation_.step_by(dt, changed);
        prepare_again();
    };
    next.back = [this, acceleration](std::size_t step, Interval& interval) { back_by(step, acceleration, interval); };
    next.names = detail::names_of(acceleration);
    next.loads = detail::RecordedLoads<S, D>(simulation_.sets_);
    intervals_.push_back(std::move(next));
}

template <class Simulation>
template <std::size_t I, class Add>
auto Adjoint<Simulation>::adding(const Add& add) {
    return [this, add] {
        auto& set = simulation_.template set_at<I>();
        add(set.particles, bars_of<std::remove_cvref_t<decltype(set)>>(bars_[I]));
    };
}

template <class Simulation>
double Adjoint<Simulation>::add_measure(Measure measure) {
    measure.state = steps();
    const double value = measure.value ? measure.value() : 0;
    measured_ += value;
    measures_.push_back(std::move(measure));
    return value;
}

template <class Simulation>
template <std::size_t I, class Function>
double Adjoint<Simulation>::measure(const Function& f, const Body* body) {
    return add_measure(measure_of<I>(f, body));
}

template <class Simulation>
template <std::size_t I, class Function>
void Adjoint<Simulation>::measure_steps(const Function& f, const Body* body) {
    each_step_.push_back([this, measure = measure_of<I>(f, body)] { add_measure(measure); });
}

template <class Simulation>
template <class Function>
double Adjoint<Simulation>::add_reaction(std::size_t part, const Function& f) {
    const auto& reactions = simulation_.reactions;
    if (!reactions)
        throw usage_error(
            "A measure of reactions needs a simulation that counts them: call simulation.reactions.emplace() before "
            "the step.");
    if (part >= reactions->parts.size())
        throw parameter_error(sentence("The boundary has no part ", part, "; it has ", reactions->parts.size(), "."));
    const Reaction<D> by = detail::derivative_by(reactions->parts[part], f);
    const bool turns = [&] {
        if constexpr (D == 2)
            return by.angular_impulse != 0;
        else
            return norm(by.angular_impulse) > 0;
    }();
    if (turns && !reactions->about && by.about != Vec<double, D>::zero())
        throw usage_error(
            "This measure depends on the angular impulse about a part that may move. Let the program give the point, "
            "simulation.reactions->about, which is held.");
    std::vector<Reaction<D>>& parts = by_reactions_[steps() - 1];
    parts.resize(reactions->parts.size());
    parts[part].about = by.about;
    parts[part] += by;
    return add_measure({steps(), [] {},
                        [this, part, f] {
                            const Reaction<D>& now = simulation_.reactions->parts.at(part);
                            return double(f(detail::measured_reaction<double>(now, [](double x) { return x; })));
                        }});
}

template <class Simulation>
template <class Function>
double Adjoint<Simulation>::measure_reaction(std::size_t part, const Function& f) {
    require_as_left();
    if (steps() == 0) throw usage_error("There is no reaction before the first step: call step() or advance() first.");
    return add_reaction(part, f);
}

template <class Simulation>
template <class Function>
void Adjoint<Simulation>::measure_reaction_steps(std::size_t part, const Function& f) {
    require_as_left();
    each_step_.push_back([this, part, f] { add_reaction(part, f); });
}

template <class Simulation>
template <std::size_t I, class Function>
typename Adjoint<Simulation>::Measure Adjoint<Simulation>::measure_of(const Function& f, const Body* body) {
    require_as_left();
    auto& own = simulation_.template set_at<I>();
    using Material = std::remove_cvref_t<decltype(own.material)>;
    if (body) own.check_body(*body);
    const Body whole = body ? *body : Body{0, no_particle};  // those that come in later, too
    const auto counts = [whole](const auto& particles, std::size_t slot) {
        return particles.is_particle(slot) && whole.holds(particles.id(slot));
    };
    using Plain = material_state_t<with_scalar_t<Material, double>, D>;
    const auto value = [this, f, counts] {
        const auto& particles = simulation_.template set_at<I>().particles;
        double sum = 0;
        for (const std::uint32_t slot : slots_by_id(particles, 1))
            if (counts(particles, slot))
                sum += double(f(detail::measured<double, D, Plain>(particles, slot, [](double x) { return x; })));
        return sum;
    };
    const auto to_bars = adding<I>([this, f, counts](const auto& particles, const auto& bar) {
        using Number = traced<double>;
        using State = material_state_t<with_scalar_t<Material, Number>, D>;
        const double h = simulation_.domain().cell_size;
        detail::for_chunks(particles.slots(), simulation_.workers(), [&](std::size_t first, std::size_t last) {
            Tape<double>& tape = Tape<double>::mine();
            std::vector<Number> numbers;
            for (std::size_t slot = first; slot < last; ++slot) {
                if (!counts(particles, slot)) continue;
                tape.cut(1);
                numbers.clear();
                const Number result = f(detail::measured<Number, D, State>(particles, slot, [&](double x) {
                    numbers.push_back(Number::input(x));
                    return numbers.back();
                }));
                tape.begin();
                detail::seed(result, 1.0);
                tape.back();
                std::size_t next = 0;
                const auto add = [&](const BlockedSpan<S>& field, double scale) {
                    for (int k = 0; k < field.components; ++k)
                        *field.at(slot, k) += S(scale * detail::adjoint_of(numbers[next++]));
                };
                add(bar.position, h);
                add(bar.velocity, 1);
                add(bar.mass, 1);
                add(bar.volume, 1);
                for (const BlockedSpan<S>& field : bar.state) add(field, 1);
            }
        });
    });
    return {steps(), to_bars, value};
}

template <class Simulation>
template <std::size_t I>
void Adjoint<Simulation>::measure_own(std::vector<Vec<double, D>> by_position,
                                      std::vector<Vec<double, D>> by_velocity) {
    require_as_left();
    const std::size_t ids = simulation_.template set_at<I>().particles.next_id();
    for (const auto* list : {&by_position, &by_velocity})
        if (!list->empty() && list->size() != ids)
            throw parameter_error(sentence("A measure has derivatives for ", list->size(), " particles; there are ",
                                           ids, " ids of this material. Give one for each id, or none."));
    add_measure({steps(),
                 adding<I>([this, by_position = std::move(by_position), by_velocity = std::move(by_velocity)](
                               const auto& particles, const auto& bar) {
                     const double h = simulation_.domain().cell_size;
                     for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
                         if (!particles.is_particle(slot)) continue;
                         const std::uint32_t id = particles.id(slot);
                         for (int a = 0; a < D; ++a) {
                             if (!by_position.empty()) *bar.position.at(slot, a) += S(by_position[id][a] * h);
                             if (!by_velocity.empty()) *bar.velocity.at(slot, a) += S(by_velocity[id][a]);
                         }
                     }
                 }),
                 {}});
}

}  // namespace firn::inline FIRN_BUILD
