/// \file Bodies of Adjoint: the way back.
#pragma once

#include <firn/adjoint/adjoint.hpp>

namespace firn::inline FIRN_BUILD {

template <class Simulation>
void Adjoint<Simulation>::use(const Interval& interval) {
    simulation_.gravity = interval.gravity;
    simulation_.transfer = interval.transfer;
    interval.loads.give_to(simulation_.sets_);
}

template <class Simulation>
auto Adjoint<Simulation>::interval_of(std::size_t step) -> Interval& {
    // The last one that begins at the step or before: a call that took no step has none.
    return *std::prev(std::ranges::upper_bound(intervals_, step, {}, &Interval::first));
}

template <class Simulation>
auto Adjoint<Simulation>::begin_step(std::size_t step) -> Interval& {
    Interval& interval = interval_of(step);
    use(interval);
    if (interval.first == step) simulation_.boundary = interval.boundary;
    return interval;
}

template <class Simulation>
void Adjoint<Simulation>::take_again(std::size_t step, Nodes* keep) {
    const Interval& interval = begin_step(step);
    keep_ = keep;
    interval.step(dts_[step], nullptr, 0);
    keep_ = nullptr, leave_ = nullptr;
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
        detail::copy_and_fill(from, to.size(), to.data(), to.size(), S(0), simulation_.workers());
    };
    simulation_.add_pass("keep nodes", "p2g", [=, this](Simulation&, const StepNow<S, D>&) {
        keep(simulation_.grid_.nodes(0), &Nodes::momenta);
        if constexpr (blended) keep(simulation_.grid_.layer(layer::before_forces), &Nodes::before_forces);
    });
}

template <class Simulation>
void Adjoint<Simulation>::leave_states() {
    PassList<S, D> passes;
    for (Pass<S, D> pass : simulation_.passes_) {
        if (pass.name == "g2p")
            pass.act = [this, act = pass.act](RunOf<S, D>& run, StepNow<S, D>& now) {
                if (!leave_) return act(run, now);
                Simulation::Passes::gather_set(simulation_, now, [&]<class Set>(Set& set) {
                    auto& before = static_cast<Set&>(*leave_->sets[now.set]);
                    detail::leave_fields(set, before);
                    return detail::g2p_from_to<Kernel, Transfer, Force, Volume>(
                        now.threads, before.particles.view(), set.particles.view(), set.partition, simulation_.grid_,
                        set.material, now.dt, simulation_.transfer);
                });
            };
        passes.add(std::move(pass));
    }
    simulation_.passes_ = std::move(passes);
}

template <class Simulation>
void Adjoint<Simulation>::sort() {
    bool is_due = false;
    for (std::size_t k = 0; k < simulation_.sets_.size(); ++k) {
        SetOf<S, D>& set = simulation_.sets_[k];
        if (!simulation_.is_sort_due(set)) continue;
        simulation_.sort(k, simulation_.ranks(), simulation_.workers());
        set.report.sort_needed = false;  // the step need not sort again
        set.readiness.prepare();
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
        use(interval_of(at));  // which says whether the step has loads
        kept_->keep_again(at, [&](Snapshot& into) { keep_before_step(into); });
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
        if (Volume::averages_volume) bars_[k].of_averages.resize(slots);
    });
}

template <class Simulation>
void Adjoint<Simulation>::back(std::size_t step) {
    Interval& interval = begin_step(step);
    move_boundary_back(step, interval);
    interval.back(step, interval);
}

template <class Simulation>
void Adjoint<Simulation>::move_boundary_back(std::size_t step, Interval& interval) {
    auto& of = interval.of_boundary;
    if (const Interval& next = interval_of(step + 1); step + 1 < steps() && &next != &interval) {
        of = next.of_boundary;
        for (std::size_t k = 0; k < of.size(); ++k)
            if (!next.carried[k]) of[k] = 0;
    }
    of = detail::TracedMotion(simulation_.boundary, dts_[step]).back(of);
}

template <class Simulation>
auto Adjoint<Simulation>::by_reactions_of(std::size_t step) const -> const std::vector<Reaction<D>>& {
    static const std::vector<Reaction<D>> none;
    const auto found = by_reactions_.find(step);
    return found == by_reactions_.end() ? none : found->second;
}

template <class Simulation>
void Adjoint<Simulation>::copy_nodes(const aligned_vector<S>& from, SparseGrid<S, D>& to) const {
    detail::copy_and_fill(from.data(), from.size(), to.nodes(0), from.size(), S(0), simulation_.workers());
}

template <class Simulation>
template <class Acceleration>
void Adjoint<Simulation>::bring_nodes(double dt, const Acceleration& acceleration) {
    SparseGrid<S, D>& grid = simulation_.grid_;
    simulation_.with_step(dt, acceleration, [&](StepNow<S, D>& now) {
        keep_ = nodes_.are_kept ? nullptr : &nodes_;
        for (const Pass<S, D>& pass : simulation_.passes_) {
            if (pass.name == "push") before_push_.keep(simulation_.sets_, simulation_.workers());
            if (pass.name == "p2g" && nodes_.are_kept) {
                if constexpr (blended) {
                    copy_nodes(nodes_.before_forces, grid);
                    grid.exchange(layer::before_forces, simulation_.workers());
                }
                copy_nodes(nodes_.momenta, grid);
            } else if (refines_velocities<Transfer> && pass.name == "refine velocities") {
                if constexpr (refines_velocities<Transfer>) {
                    const auto sets = simulation_.motions();
                    detail::refine_and_keep<Kernel>(simulation_.execution, grid, simulation_.transfer,
                                                    simulation_.transfer_memory_, now.mirrors,
                                                    ParticleSets<detail::MotionOf<S, D>>(sets), series_);
                }
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
void Adjoint<Simulation>::mirror_back(std::size_t step, const Acceleration& acceleration, const Mirrors& mirrors,
                                      Interval& interval) {
    if constexpr (has_mirrors<Boundary>) {
        if (mirrors.planes.empty()) return;
        const int threads = simulation_.workers();
        before_walls_.activate(simulation_.partitions(), threads);
        copy_nodes(momenta_before_update(), before_walls_);
        detail::update_grid(threads, detail::one_rank<S, D>(), before_walls_, dts_[step], acceleration,
                            simulation_.boundary);
        std::vector<double> by_wall(mirrors.planes.size());
        detail::mirror_nodes_back(threads, before_walls_, bar_grid_, mirrors, true, by_wall, by_reactions_of(step));
        const std::vector<std::size_t> of_walls = detail::frictions_of_mirrors(simulation_.boundary);
        for (std::size_t k = 0; k < by_wall.size(); ++k) interval.of_boundary[of_walls[k]] += by_wall[k];
    }
}

template <class Simulation>
template <class Sets>
void Adjoint<Simulation>::mirror_before_back(const Sets& sets, const Mirrors& mirrors) {
    const int threads = simulation_.workers();
    before_walls_.activate(simulation_.partitions(), threads);
    p2g<Kernel, Transfer, detail::NoForceFor<Transfer>>(simulation_.execution, before_walls_, 0.0, sets);
    const S* const momenta = before_walls_.nodes(0);
    momenta_before_.assign(momenta, momenta + nodes_.momenta.size());
    detail::divide_by_masses(threads, before_walls_);
    std::vector<double> by_wall(mirrors.planes.size());
    detail::mirror_nodes_back(threads, before_walls_, bar_before_, mirrors, false, by_wall);
}

template <class Simulation>
void Adjoint<Simulation>::series_back(const Mirrors& mirrors) {
    if constexpr (refines_velocities<Transfer>) {
        const int threads = simulation_.workers();
        std::vector<detail::SetOfSeries<S, D>> sets;
        simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
            sets.push_back({{set.particles.motion(), set.partition},
                            motion_of(bars_of<Set>(bars_[k])),
                            {bars_[k].records.data(), detail::record_size<detail::NoForceNoField, D>}});
        });
        for (SparseGrid<S, D>* const grid : {&before_walls_, &bar_before_})
            grid->activate(simulation_.partitions(), threads);
        detail::SeriesBack<Kernel, Transfer, S, D>{threads, nodes_.momenta, series_,     mirrors,
                                                   sets,    before_walls_,  bar_before_, simulation_.transfer_memory_}
            .go(simulation_.execution, bar_grid_);
    }
}

template <class Simulation>
template <class Acceleration>
void Adjoint<Simulation>::back_by(std::size_t step, const Acceleration& acceleration, Interval& interval) {
    const double dt = dts_[step];
    const int threads = simulation_.workers();
    SparseGrid<S, D>& grid = simulation_.grid_;
    bring_nodes(dt, acceleration);
    fit_bars();

    // G2P backwards: records, then their scatter.
    using Sets = ParticleSets<MotionView<S, D, BlockedSpan<S>>>;
    const auto motion_sets = simulation_.motions();
    const Sets motions(motion_sets);
    const Mirrors mirrors = mirrors_of<Kernel>(simulation_.boundary, simulation_.domain());
    std::vector<ParticleSet<detail::RecordView<MotionView<S, D, BlockedSpan<S>>>>> records, records_before;
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        Bars& bars = bars_[k];
        const auto view = set.particles.view(), bar = bars_of<Set>(bars);
        if constexpr (Volume::averages_volume)
            average_volume<Kernel, Transfer, Force>(simulation_.execution, grid, volume_memory_, mirrors, k, motions);
        const BlockedSpan<S> of_velocities{bars.records.data(), detail::record_size<Force, D>},
            of_before{bars.records_before.data(), D + D * D}, of_averages{bars.of_averages.data(), 1};
        using Material = std::remove_cvref_t<decltype(set.material)>;
        const detail::G2PBack<Kernel, Transfer, Force, Volume, Material, S, D,
                              typename std::remove_cvref_t<decltype(view)>::state_type>
            go(view, bar, set.partition, grid, set.material, dt, simulation_.transfer, of_velocities, of_before,
               of_averages);
        const std::size_t of_material = go.of_material(), of_transfer = go.of_transfer();
        detail::OrderedSums sums(set.partition.groups.size(), of_material + of_transfer);
        parallel_for(set.partition.groups.size(), threads, [&](std::size_t g, int) { go(g, sums.of(g)); });
        sums.add_to(of_material_[k], of_material, interval.of_transfer);
        if constexpr (Volume::averages_volume) {
            bar_grid_.activate(simulation_.partitions(), threads);
            detail::average_volume_back<Kernel, Transfer, Force>(simulation_.execution, grid, mirrors, view, bar,
                                                                 set.partition, of_averages, bar_grid_, of_velocities);
        }
        records.push_back({{view.position, of_velocities}, set.partition});
        if (blended) records_before.push_back({{view.position, of_before}, set.partition});
    });
    const auto scatter = [&]<class Form>(SparseGrid<S, D>& to, const auto& of, std::type_identity<Form>) {
        using View = detail::RecordView<MotionView<S, D, BlockedSpan<S>>>;
        to.activate(simulation_.partitions(), threads);
        p2g<Kernel, detail::RecordTransfer, Form>(simulation_.execution, to, 0.0, ParticleSets<View>(of));
    };
    scatter(bar_grid_, records, std::type_identity<Force>{});

    // Walls and the grid update backwards.
    mirror_back(step, acceleration, mirrors, interval);
    const Vec<double, D> corner = simulation_.domain().lower;
    const auto here = on_grid(measured_from(simulation_.boundary, corner), simulation_.domain().cell_size);
    const auto lifted = lift<T>(here);
    const auto field = detail::traced_acceleration<P, D>(acceleration, corner);
    const std::size_t of_field = detail::count_of_inputs<P>(field), of_walls = detail::count_of_inputs<P>(lifted);
    detail::OrderedSums sums(grid.block_count(), of_field + of_walls);
    detail::update_grid_back<S, D>(threads, grid, momenta_before_update().data(), bar_grid_.nodes(0), dt, field, here,
                                   lifted, sums, by_reactions_of(step));
    sums.add_to(interval.of_acceleration, of_field, interval.of_boundary);
    series_back(mirrors);
    if constexpr (blended) {
        scatter(bar_before_, records_before, std::type_identity<detail::NoForceNoField>{});
        if (!mirrors.planes.empty()) {
            mirror_before_back(motions, mirrors);
        } else {
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
        }
        detail::divide_by_masses_back(threads, grid, momenta_before_.data(), bar_before_.nodes(0));
    }

    // P2G backwards.
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        const auto view = set.particles.motion();
        const auto bar = motion_of(bars_of<Set>(bars_[k]));
        // The series of FMPM has added to the adjoints of the particles before.
        detail::p2g_back<Kernel, Transfer, Force, !refines_velocities<Transfer>>(threads, view, bar, set.partition,
                                                                                 grid, bar_grid_.nodes(0), dt);
        if constexpr (blended)
            detail::p2g_back<Kernel, Transfer, detail::NoForceFor<Transfer>, false>(threads, view, bar, set.partition,
                                                                                    grid, bar_before_.nodes(0), dt);
    });

    // The push backwards.
    before_push_.give_back(simulation_.sets_, threads);
    simulation_.for_materials([&]<class Set>(Set& set, std::size_t k) {
        interval.loads.back(k, set.particles, motion_of(bars_of<Set>(bars_[k])), simulation_.now_.time, dt, threads);
    });
}

template <class Simulation>
void Adjoint<Simulation>::add_measures(std::size_t state) {
    for (const Measure& measure : std::ranges::equal_range(measures_, state, {}, &Measure::state)) measure.add();
}

template <class Simulation>
template <class Set>
void Adjoint<Simulation>::stress_back(Set& set, std::size_t k) {
    using Material = std::remove_cvref_t<decltype(set.material)>;
    const auto bar = bars_of<Set>(bars_[k]);
    const std::size_t count = detail::count_of_inputs<P>(lift<T>(set.material)), slots = set.partition.slots();
    detail::OrderedSums sums(slots / pack_size, count);
    detail::update_stress_back<Material, S, D>(simulation_.workers(), set.particles.view(), bar, set.partition,
                                               set.material, sums);
    of_material_[k].resize(count);
    sums.add_to(of_material_[k]);
    std::fill_n(bar.stress.at(0, 0), slots * std::size_t(bar.stress.components), S(0));
}

template <class Simulation>
void Adjoint<Simulation>::bring_state_before(std::size_t state, Gradient<Simulation>& gradient) {
    const auto changes = std::ranges::equal_range(changes_, state, {}, &Change::state);
    simulation_.for_materials([&](auto& set, std::size_t k) {
        if (std::ranges::find(changes, k, &Change::set) != changes.end()) stress_back(set, k);
    });
    bring_state(state - 1);
    if (!changes.empty()) write_particles(gradient, true);
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
    make_room(gradient);
    gradient.position_norm.resize(steps() + 1), gradient.velocity_norm.resize(steps() + 1);
    of_material_.assign(simulation_.sets_.size(), {});
    for (Interval& interval : intervals_) {
        interval.of_acceleration = interval.of_boundary = interval.of_transfer = {};
        interval.loads.forget();
    }
    for (Bars& bars : bars_) bars.forget();
    keep_nodes();
    leave_states();
    parallel_region(simulation_.workers(), [&] {
        fit_bars();
        add_measures(steps());
        note_norms(steps(), gradient);
        for (std::size_t step = steps(); step-- > 0;) {
            bring_state_before(step + 1, gradient);
            back(step);
            add_measures(step);
            note_norms(step, gradient);
        }
        simulation_.for_materials([&](auto& set, std::size_t k) { stress_back(set, k); });
    });
    write_particles(gradient, false);
    write(gradient);
    return gradient;
}

template <class Simulation>
void Adjoint<Simulation>::make_room(Gradient<Simulation>& gradient) {
    unroll<int(Simulation::material_count)>([&](auto i) {
        auto& to = std::get<i>(gradient.sets);
        const std::size_t ids = simulation_.template set_at<i>().particles.next_id();
        to.position.assign(ids, Vec<double, D>::zero());
        to.velocity.assign(ids, Vec<double, D>::zero());
        to.affine.assign(ids, Mat<double, D>::zero());
        to.mass.assign(ids, 0), to.volume.assign(ids, 0);
        to.state.assign(ids, {});
    });
}

template <class Simulation>
void Adjoint<Simulation>::write_particles(Gradient<Simulation>& gradient, bool newcomers) {
    const double h = simulation_.domain().cell_size;
    unroll<int(Simulation::material_count)>([&](auto i) {
        constexpr std::size_t K = i;
        auto& set = simulation_.template set_at<K>();
        auto& to = std::get<K>(gradient.sets);
        const auto view = bars_of<std::remove_cvref_t<decltype(set)>>(bars_[K]);
        const std::uint32_t first = newcomers ? set.particles.next_id() : 0;
        for (std::size_t slot = 0; slot < bars_[K].ids().size(); ++slot) {
            const std::uint32_t id = bars_[K].ids()[slot];
            if (id == no_particle || id < first) continue;
            for (int a = 0; a < D; ++a) {
                to.position[id][a] = double(*view.position.at(slot, a)) / h;
                to.velocity[id][a] = double(*view.velocity.at(slot, a));
            }
            for (int k = 0; k < D * D; ++k) to.affine[id].m[k] = double(*view.affine.at(slot, k));
            to.mass[id] = double(*view.mass.at(slot, 0)), to.volume[id] = double(*view.volume.at(slot, 0));
            detail::write_state(view.state, slot, to.state[id]);
        }
    });
}

template <class Simulation>
void Adjoint<Simulation>::write(Gradient<Simulation>& gradient) {
    // Writes numbers to a policy; where no step was taken there are none, and all are 0.
    const auto fill = [](auto& policy, const std::vector<double>& numbers) {
        std::size_t next = 0;
        detail::for_numbers<double>(policy, [&](double& number) { number = numbers.empty() ? 0 : numbers[next++]; });
    };
    unroll<int(Simulation::material_count)>([&](auto i) {
        constexpr std::size_t K = i;
        auto& to = std::get<K>(gradient.sets);
        to.material = lift<double>(simulation_.template set_at<K>().material);
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
        to.loads = from.loads.derivatives();
    }
}

}  // namespace firn::inline FIRN_BUILD
