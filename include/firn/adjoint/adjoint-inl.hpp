/// \file Bodies of adjoint.hpp.
#pragma once

#include <firn/adjoint/adjoint.hpp>

namespace firn::inline FIRN_BUILD {

template <class Simulation>
Adjoint<Simulation>::Adjoint(Simulation& simulation, const AdjointOptions& options)
    : simulation_(simulation), bar_grid_(simulation.domain()), bar_before_(simulation.domain()) {
    refuse_what_has_no_way_back();
    simulation_.prepare();
    moments_.push_back(simulation_.now_);
    std::size_t bytes = 0;
    for (const SetOf<S, D>& set : simulation_.sets_)
        bytes += set.store().bytes() + set.partition.order.size() * sizeof(std::uint32_t) +
                 set.partition.ranges.size() * sizeof(BlockRange<D>) + set.partition.groups.size() * sizeof(BlockGroup);
    // Room for the nodes of the step, with a quarter more, because matter may spread.
    room_for_nodes_ =
        simulation_.grid_.block_count() * std::size_t(block_nodes<D> * node_width) * sizeof(S) * (blended ? 10 : 5) / 4;
    bytes += room_for_nodes_;
    const std::size_t most = options.memory / std::max<std::size_t>(bytes, 1);
    if (most < 3)
        throw parameter_error(sentence("A checkpoint of this simulation takes ", bytes, " bytes, and ", options.memory,
                                       " are granted; give the adjoint memory for three at least: two checkpoints, and "
                                       "the state at the end."));
    kept_ = std::make_unique<Checkpoints<Snapshot>>(std::min<std::size_t>(most - 1, 1 << 20));
    kept_->keep(0, [&](Snapshot& to) { store(to); });
    bars_.resize(simulation_.sets_.size());
}

template <class Simulation>
void Adjoint<Simulation>::refuse_what_has_no_way_back() const {
    for (const Pass<S, D>& pass : simulation_.passes()) {
        constexpr std::string_view known[] = {
            "sort", "push", "p2g", "grid update", "g2p", "end g2p", "sinks and sources"};
        if (std::ranges::find(known, pass.name) == std::end(known))
            throw usage_error(sentence("The pass \"", pass.name,
                                       "\" of this simulation has no way back, so there are no derivatives through "
                                       "it. Choose another policy, or leave the pass out."));
    }
    for (const SetOf<S, D>& set : simulation_.sets())
        if (set.loads || set.forces || !set.sources.empty() || !set.sinks.empty())
            throw usage_error(
                "This simulation has loads, forces between particles, sources or sinks. They have no way back: there "
                "are no derivatives through them.");
    if (!mirrors_of<Kernel>(simulation_.boundary, simulation_.domain()).planes.empty())
        throw usage_error(
            "Mirrored walls have no way back: there are no derivatives through them. Let walls hold the "
            "nodes behind them, NodesBehind::held.");
    bool moves = detail::speed_of_boundary<S>(simulation_.boundary, simulation_.domain()) > 0;
    detail::for_single_parts(simulation_.boundary, [&]<class Part>(const Part& part, bool) {
        const Vec<double, D> x = Vec<double, D>::zero();
        if constexpr (requires { part.advanced(0.0); } && !requires { part.largest_speed(x, x); }) moves = true;
    });
    if (moves) throw usage_error("A boundary that moves has no way back: there are no derivatives through it.");
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
    begin_interval(detail::own_acceleration<D>(acceleration));
    // A last pass of each step records it.
    struct Recording {
        Simulation& simulation;
        PassList<S, D> passes;
        ~Recording() { simulation.passes_ = std::move(passes); }
    } recording{simulation_, simulation_.passes_};
    simulation_.add_pass("record", "sinks and sources", [this](Simulation&, const StepNow<S, D>& now) {
        dts_.push_back(now.dt);
        moments_.push_back(simulation_.now_);
        repetitions_.push_back(0);
        kept_->keep(steps(), [&](Snapshot& to) { store(to); });
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
    next.transfer = simulation_.transfer;
    next.is_uniform = detail::is_uniform<Acceleration>;
    unroll<int(Simulation::material_count)>(
        [&](auto i) { std::get<i>(next.materials) = simulation_.template set_at<i>().material; });
    next.step = [this, acceleration](double dt, [[maybe_unused]] const Vec<double, D>& more) {
        if constexpr (detail::is_uniform<Acceleration>)
            simulation_.step_by(dt, acceleration + cast<std::remove_cvref_t<decltype(acceleration.v[0])>>(more));
        else
            simulation_.step_by(dt, acceleration);
    };
    next.back = [this, acceleration](double dt, Interval& interval) { back_by(dt, acceleration, interval); };
    for_parameters(acceleration, [&](const std::string& name, const char*, const auto& value) {
        if constexpr (detail::is_vector<std::remove_cvref_t<decltype(value)>>)
            for (int a = 0; a < D; ++a) next.names.push_back(sentence(name, "[", a, "]"));
        else
            next.names.push_back(name);
    });
    intervals_.push_back(std::move(next));
}

template <class Simulation>
void Adjoint<Simulation>::use(const Interval& interval) {
    simulation_.gravity = interval.gravity;
    simulation_.transfer = interval.transfer;
    unroll<int(Simulation::material_count)>(
        [&](auto i) { simulation_.template set_at<i>().material = std::get<i>(interval.materials); });
}

template <class Simulation>
auto Adjoint<Simulation>::interval_of(std::size_t step) -> Interval& {
    // The last one that begins at the step or before: a call that took no step has none.
    return *std::prev(std::ranges::upper_bound(intervals_, step, {}, &Interval::first));
}

template <class Simulation>
void Adjoint<Simulation>::take_again(std::size_t step, Nodes* keep) {
    Interval& interval = interval_of(step);
    use(interval);
    if (interval.first == step) simulation_.boundary = interval.boundary;
    keep_ = keep;
    interval.step(dts_[step], Vec<double, D>::zero());
    keep_ = nullptr;
    if (keep) keep->are_kept = !keep->momenta.empty();
    simulation_.now_ = moments_[step + 1];
    ++repetitions_[step];
}

template <class Simulation>
void Adjoint<Simulation>::keep_nodes() {
    const auto keep = [this](const S* from, aligned_vector<S> Nodes::* member) {
        if (!keep_ || !from) return;
        auto& to = keep_->*member;
        const std::size_t numbers = simulation_.grid_.block_count() * std::size_t(block_nodes<D> * node_width);
        const bool is_room = keep_ == &nodes_ || (blended ? 2 : 1) * numbers * sizeof(S) <= room_for_nodes_;
        to.resize(is_room ? numbers : 0);
        detail::for_chunks(to.size(), simulation_.workers(), [&](std::size_t first, std::size_t last) {
            std::copy(from + first, from + last, to.data() + first);
        });
    };
    simulation_.add_pass("keep nodes", "p2g", [=, this](Simulation&, const StepNow<S, D>&) {
        keep(simulation_.grid_.nodes(0), &Nodes::momenta);
        if constexpr (blended) keep(simulation_.grid_.layer(layer::before_forces), &Nodes::before_forces);
    });
}

template <class Simulation>
void Adjoint<Simulation>::sort() {
    bool is_due = false;
    for (std::size_t k = 0; k < simulation_.sets_.size(); ++k)
        if (simulation_.sets_[k].report.sort_needed) {
            simulation_.sort(k, simulation_.ranks(), simulation_.workers());
            is_due = true;
        }
    if (is_due) simulation_.activate();
}

template <class Simulation>
void Adjoint<Simulation>::bring_state(std::size_t state) {
    nodes_.are_kept = false;
    kept_->forget_behind(state);
    std::size_t at = kept_->last();
    if (at == state && at > 0) {  // its last use
        kept_->take_last([&](Snapshot& from) { swap_with(from); });
        simulation_.now_ = moments_[state];
        return;
    }
    restore(kept_->state());
    simulation_.now_ = moments_[at];
    while (at < state) {
        const std::size_t to = kept_->way_to(state);
        for (; at < to; ++at) take_again(at, kept_->last() == at ? &kept_->state().nodes : nullptr);
        if (at == state) return;
        sort();
        kept_->keep_again(at, [&](Snapshot& into) { store(into); });
    }
}

template <class Simulation>
void Adjoint<Simulation>::fit_bars() {
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        using State = typename decltype(set.particles.view())::state_type;
        bars_[k].follow(field_table<S, D, State>(), set.partition.order, set.particles.next_id(),
                        simulation_.workers());
        const std::size_t slots = set.partition.order.size();
        bars_[k].records.resize(slots * std::size_t(detail::record_size<Force, D>));
        if (blended) bars_[k].records_before.resize(slots * std::size_t(D + D * D));
    });
}

template <class Simulation>
void Adjoint<Simulation>::back(std::size_t step) {
    Interval& interval = interval_of(step);
    use(interval);
    if (interval.first == step) simulation_.boundary = interval.boundary;
    interval.back(dts_[step], interval);
}

template <class Simulation>
template <class Acceleration>
void Adjoint<Simulation>::bring_nodes(double dt, const Acceleration& acceleration) {
    SparseGrid<S, D>& grid = simulation_.grid_;
    const auto copy = [&](const aligned_vector<S>& from) {
        detail::for_chunks(from.size(), simulation_.workers(), [&](std::size_t first, std::size_t last) {
            std::copy(from.data() + first, from.data() + last, grid.nodes(0) + first);
        });
    };
    simulation_.with_step(dt, acceleration, [&](StepNow<S, D>& now) {
        keep_ = nodes_.are_kept ? nullptr : &nodes_;
        for (const Pass<S, D>& pass : simulation_.passes_) {
            if (pass.name == "p2g" && nodes_.are_kept) {
                if constexpr (blended) {
                    copy(nodes_.before_forces);
                    grid.exchange(layer::before_forces, simulation_.workers());
                }
                copy(nodes_.momenta);
            } else {
                pass.act(simulation_, now);
            }
            if (pass.name == "grid update") break;
        }
        keep_ = nullptr;
    });
}

template <class Simulation>
template <class Acceleration>
void Adjoint<Simulation>::back_by(double dt, const Acceleration& acceleration, Interval& interval) {
    const int threads = simulation_.workers();
    SparseGrid<S, D>& grid = simulation_.grid_;
    bring_nodes(dt, acceleration);
    fit_bars();

    // G2P backwards: records, then their scatter.
    std::vector<ParticleSet<detail::RecordView<MotionView<S, D, BlockedSpan<S>>>>> records, records_before;
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        Bars& bars = bars_[k];
        const auto view = set.particles.view(), bar = bars_of<Set>(bars);
        const BlockedSpan<S> of_velocities{bars.records.data(), detail::record_size<Force, D>},
            of_before{bars.records_before.data(), D + D * D};
        using Material = std::remove_cvref_t<decltype(set.material)>;
        const detail::G2PBack<Kernel, Transfer, Force, Material, S, D,
                              typename std::remove_cvref_t<decltype(view)>::state_type>
            go(view, bar, set.partition, grid, set.material, dt, simulation_.transfer, of_velocities, of_before);
        const std::size_t of_material = go.of_material(), of_transfer = go.of_transfer();
        detail::OrderedSums sums(set.partition.groups.size(), of_material + of_transfer);
        parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) { go(g, sums.of(g)); });
        sums.add_to(of_material_[k], of_material, interval.of_transfer);
        records.push_back({{view.position, of_velocities}, set.partition});
        if (blended) records_before.push_back({{view.position, of_before}, set.partition});
    });
    const auto scatter = [&]<class Form>(SparseGrid<S, D>& to, const auto& of, std::type_identity<Form>) {
        using View = detail::RecordView<MotionView<S, D, BlockedSpan<S>>>;
        to.activate(simulation_.partitions(), threads);
        p2g<Kernel, detail::RecordTransfer, Form>(simulation_.execution, to, 0.0, ParticleSets<View>(of));
    };
    scatter(bar_grid_, records, std::type_identity<Force>{});

    // The grid update backwards.
    const Vec<double, D> corner = simulation_.domain().lower;
    const auto here = on_grid(measured_from(simulation_.boundary, corner), simulation_.domain().cell_size);
    const auto lifted = lift<T>(here);
    const auto nodes_back = [&](const S* momenta, S* bars, double time, const auto& field, const auto& from,
                                const auto& walls, std::vector<double>& of_field, std::vector<double>& of_walls) {
        const std::size_t a = detail::count_of_inputs<P>(field), b = detail::count_of_inputs<P>(walls);
        detail::OrderedSums sums(grid.block_count(), a + b);
        detail::update_grid_back<S, D>(threads, grid, momenta, bars, time, field, from, walls, sums);
        sums.add_to(of_field, a, of_walls);
    };
    nodes_back(nodes_.momenta.data(), bar_grid_.nodes(0), dt, detail::traced_acceleration<P, D>(acceleration, corner),
               here, lifted, interval.of_acceleration, interval.of_boundary);
    if constexpr (blended) {
        scatter(bar_before_, records_before, std::type_identity<detail::NoForceNoField>{});
        // The nodes hold velocities; their momenta are velocity × mass.
        const S* const velocities = grid.layer(layer::before_forces);
        momenta_before_.resize(nodes_.momenta.size());
        detail::for_chunks(momenta_before_.size() / node_width, threads, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i) {
                const S* const from = velocities + i * node_width;
                S* const to = momenta_before_.data() + i * node_width;
                for (int k = 0; k < node_mass; ++k) to[k] = from[k] * from[node_mass];
                to[node_mass] = from[node_mass];
            }
        });
        std::vector<double> none, nothing;
        nodes_back(momenta_before_.data(), bar_before_.nodes(0), 0,
                   detail::traced_acceleration<P, D>(Vec<double, D>::zero(), corner), NoBoundary{}, NoBoundary{}, none,
                   nothing);
    }

    // P2G backwards.
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        const auto view = set.particles.motion();
        const auto bar = motion_of(bars_of<Set>(bars_[k]));
        detail::p2g_back<Kernel, Transfer, Force>(threads, view, bar, set.partition, grid, bar_grid_.nodes(0), dt);
        if constexpr (blended)
            detail::p2g_back<Kernel, Transfer, detail::NoForceFor<Transfer>>(threads, view, bar, set.partition, grid,
                                                                             bar_before_.nodes(0), dt);
    });
}

template <class Simulation>
template <std::size_t I, class Add>
void Adjoint<Simulation>::add_measure(const Add& add, std::function<double()> value) {
    const auto go = [this, add] {
        auto& set = simulation_.template set_at<I>();
        add(set.particles, bars_of<std::remove_cvref_t<decltype(set)>>(bars_[I]));
    };
    measures_.push_back({steps(), go, std::move(value)});
}

template <class Simulation>
template <std::size_t I, class Function>
double Adjoint<Simulation>::measure(const Function& f, const Body* body) {
    require_as_left();
    auto& own = simulation_.template set_at<I>();
    using Material = std::remove_cvref_t<decltype(own.material)>;
    if (body) own.check_body(*body);
    const Body whole = body ? *body : Body{0, own.particles.next_id()};
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
    add_measure<I>(
        [this, f, counts](const auto& particles, const auto& bar) {
            using Number = traced<double>;
            using State = material_state_t<with_scalar_t<Material, Number>, D>;
            const double h = simulation_.domain().cell_size;
            detail::for_chunks(particles.slots(), simulation_.workers(), [&](std::size_t first, std::size_t last) {
                Tape<double>& tape = Tape<double>::mine();
                for (std::size_t slot = first; slot < last; ++slot) {
                    if (!counts(particles, slot)) continue;
                    tape.cut(1);
                    std::vector<Number> numbers;
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
        },
        value);
    return value();
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
    add_measure<I>([this, by_position = std::move(by_position), by_velocity = std::move(by_velocity)](
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
    });
}

template <class Simulation>
void Adjoint<Simulation>::add_measures(std::size_t state) {
    for (const Measure& measure : std::ranges::equal_range(measures_, state, {}, &Measure::state)) measure.add();
}

template <class Simulation>
void Adjoint<Simulation>::note_norms(std::size_t state, Gradient<Simulation>& gradient) {
    double positions = 0, velocities = 0;
    const double h = simulation_.domain().cell_size;
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        const auto& particles = set.particles;
        const auto bar = bars_of<Set>(bars_[k]);
        // Whole arrays: there, the adjoints of padding are 0.
        const std::size_t slots = set.partition.order.size();
        detail::OrderedSums sums((slots + detail::at_once - 1) / detail::at_once, 2);
        detail::for_chunks(slots, simulation_.workers(), [&](std::size_t first, std::size_t last) {
            const auto add = [&](const BlockedSpan<S>& field, double& to) {
                double of_lanes[pack_size] = {};
                for (const S* number = field.at(first, 0); number != field.at(first, 0) + (last - first) * D;
                     number += pack_size)
                    for (int lane = 0; lane < pack_size; ++lane)
                        of_lanes[lane] += double(number[lane]) * double(number[lane]);
                for (const double& of_lane : of_lanes) to += of_lane;
            };
            add(bar.position, sums.of(first / detail::at_once)[0]);
            add(bar.velocity, sums.of(first / detail::at_once)[1]);
        });
        double total[2] = {};
        sums.add_to(total);
        if (!std::isfinite(total[0] + total[1]))
            for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
                double sum = 0;
                for (int a = 0; a < D && particles.is_particle(slot); ++a)
                    sum += double(*bar.position.at(slot, a)) + double(*bar.velocity.at(slot, a));
                if (!std::isfinite(sum))
                    throw particle_error(sentence(
                        "The derivative of the measures by particle ", particles.id(slot), " of material ", k,
                        " before step ", state, ", at ", moments_[state].time,
                        " s, is not finite: a formula has no derivative there, or the run is so chaotic that its "
                        "derivatives overflow. Measure over fewer steps, or look at the particle's state."));
            }
        positions += total[0] / (h * h), velocities += total[1];
    });
    gradient.position_norm[state] = std::sqrt(positions);
    gradient.velocity_norm[state] = std::sqrt(velocities);
}

template <class Simulation>
Gradient<Simulation> Adjoint<Simulation>::gradient() {
    if (measures_.empty())
        throw usage_error("Nothing was measured: call measure() at the times that count, then gradient().");
    require_as_left();
    kept_->finish([&](Snapshot& to) { store(to); });
    Snapshot end;
    store(end);
    const Vec<double, D> gravity = simulation_.gravity;
    const Transfer transfer = simulation_.transfer;
    const Restored restored{*this, end, gravity, transfer};

    Gradient<Simulation> gradient;
    gradient.position_norm.resize(steps() + 1), gradient.velocity_norm.resize(steps() + 1);
    of_material_.assign(simulation_.sets_.size(), {});
    for (Interval& interval : intervals_) interval.of_acceleration = interval.of_boundary = interval.of_transfer = {};
    for (Bars& bars : bars_) bars.forget();
    keep_nodes();
    parallel_region(simulation_.workers(), [&] {
        fit_bars();
        add_measures(steps());
        note_norms(steps(), gradient);
        for (std::size_t step = steps(); step-- > 0;) {
            bring_state(step);
            back(step);
            add_measures(step);
            note_norms(step, gradient);
        }
        simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
            using Material = std::remove_cvref_t<decltype(set.material)>;
            const std::size_t count = detail::count_of_inputs<P>(lift<T>(set.material));
            detail::OrderedSums sums(set.partition.slots() / pack_size, count);
            detail::update_stress_back<Material, S, D>(simulation_.workers(), set.particles.view(),
                                                       bars_of<Set>(bars_[k]), set.partition, set.material, sums);
            of_material_[k].resize(count);
            sums.add_to(of_material_[k]);
        });
    });
    write(gradient);
    return gradient;
}

template <class Simulation>
void Adjoint<Simulation>::write(Gradient<Simulation>& gradient) {
    const double h = simulation_.domain().cell_size;
    // Writes numbers to a policy; where no step was taken there are none, and all are 0.
    const auto fill = [](auto& policy, const std::vector<double>& numbers) {
        std::size_t next = 0;
        detail::for_numbers<double>(policy, [&](double& number) { number = numbers.empty() ? 0 : numbers[next++]; });
    };
    unroll<int(Simulation::material_count)>([&](auto i) {
        constexpr std::size_t K = i;
        auto& set = simulation_.template set_at<K>();
        auto& to = std::get<K>(gradient.sets);
        const std::size_t ids = set.particles.next_id();
        to.position.assign(ids, Vec<double, D>::zero());
        to.velocity.assign(ids, Vec<double, D>::zero());
        to.affine.assign(ids, Mat<double, D>::zero());
        to.mass.assign(ids, 0), to.volume.assign(ids, 0);
        to.state.assign(ids, {});
        const auto view = bars_of<std::remove_cvref_t<decltype(set)>>(bars_[K]);
        for (std::size_t slot = 0; slot < bars_[K].ids().size(); ++slot) {
            const std::uint32_t id = bars_[K].ids()[slot];
            if (id == no_particle) continue;
            for (int a = 0; a < D; ++a) {
                to.position[id][a] = double(*view.position.at(slot, a)) / h;
                to.velocity[id][a] = double(*view.velocity.at(slot, a));
            }
            for (int k = 0; k < D * D; ++k) to.affine[id].m[k] = double(*view.affine.at(slot, k));
            to.mass[id] = double(*view.mass.at(slot, 0)), to.volume[id] = double(*view.volume.at(slot, 0));
            detail::write_state(view.state, slot, to.state[id]);
        }
        to.material = lift<double>(set.material);
        fill(to.material, of_material_[K]);
    });
    for (const Interval& from : intervals_) {
        auto& to = gradient.intervals.emplace_back();
        to.from = moments_[from.first].time;
        if (from.is_uniform)
            for (std::size_t a = 0; a < from.of_acceleration.size(); ++a) to.gravity[int(a)] = from.of_acceleration[a];
        else
            for (std::size_t k = 0; k < from.of_acceleration.size(); ++k)
                to.acceleration.emplace_back(k < from.names.size() ? from.names[k] : std::string(),
                                             from.of_acceleration[k]);
        to.boundary = lift<double>(from.boundary);
        fill(to.boundary, from.of_boundary);
        to.transfer = lift<double>(from.transfer);
        fill(to.transfer, from.of_transfer);
    }
}

}  // namespace firn::inline FIRN_BUILD
