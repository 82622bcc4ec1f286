/// \file The series of FMPM backwards: from the adjoints of the momenta that it gives to those of the momenta that it
/// took, of the masses of nodes, and of the particles, which carry each term of the series there and back.
#pragma once

#include <firn/adjoint/g2p.hpp>
#include <firn/adjoint/grid_update.hpp>
#include <firn/adjoint/mirror.hpp>
#include <firn/adjoint/p2g.hpp>
#include <firn/loops/transfer_passes.hpp>

#include <algorithm>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// What P2G sees of the particles.
template <std::floating_point S, int D>
using MotionOf = MotionView<S, D, BlockedSpan<S>>;

/// What the nodes held while a step refined its velocities.
template <std::floating_point S>
struct SeriesOfNodes {
    /// What they held for one term.
    struct Term {
        aligned_vector<S> velocities,  ///< v_j
            carried;                   ///< the momenta and masses that make A v_j
    };
    std::vector<Term> terms;    ///< of v_1, v_2, … but the last
    aligned_vector<S> refined;  ///< the momenta and masses after the series
};

/// Does the work of after_p2g(), and keeps what the way back needs.
template <class Kernel, class Execution, std::floating_point S, int D, class Transfer>
void refine_and_keep(const Execution& execution, SparseGrid<S, D>& grid, const Transfer& transfer,
                     TransferMemory<S>& memory, const Mirrors& mirrors, ParticleSets<MotionOf<S, D>> sets,
                     SeriesOfNodes<S>& series) {
    const int threads = threads_of(execution);
    const auto keep = [&](const S* from, aligned_vector<S>& to) {
        to.resize(grid.block_count() * std::size_t(block_nodes<D> * node_width));
        copy_and_fill(from, to.size(), to.data(), to.size(), S(0), threads);
    };
    series.terms.resize(std::size_t(transfer.order - 1));
    if (transfer.order > 1)
        refine_momenta<Kernel>(execution, grid, transfer, memory, mirrors, threads, sets, [&](int j) {
            typename SeriesOfNodes<S>::Term& term = series.terms[std::size_t(j - 1)];
            keep(grid.layer(layer::last_of_series), term.velocities);
            keep(grid.nodes(0), term.carried);
        });
    keep(grid.nodes(0), series.refined);
}

/// A set of particles on the way back through the series.
template <std::floating_point S, int D>
struct SetOfSeries {
    ParticleSet<MotionOf<S, D>> set;
    MotionOf<S, D> bar;      ///< the adjoints of the particles
    BlockedSpan<S> records;  ///< room for records of record_size<NoForceNoField, D>
};

/// The way back of refine_momenta(). The names of numbers of nodes are those of refine_momenta().
template <class Kernel, class Transfer, std::floating_point S, int D>
class SeriesBack {
    using P = native_pack<S>;
    using T = traced<P>;

public:
    /// \param momenta           the momenta and masses of the nodes before the series
    /// \param series            what refine_and_keep() has kept
    /// \param values, adjoints  grids of the same blocks, whose nodes are overwritten
    /// \param memory            memory for velocities of particles, of refine_and_keep()
    SeriesBack(int threads, const aligned_vector<S>& momenta, const SeriesOfNodes<S>& series, const Mirrors& mirrors,
               const std::vector<SetOfSeries<S, D>>& sets, SparseGrid<S, D>& values, SparseGrid<S, D>& adjoints,
               TransferMemory<S>& memory)
        : threads_(threads),
          momenta_(momenta),
          series_(series),
          mirrors_(mirrors),
          sets_(sets),
          values_(values),
          adjoints_(adjoints),
          memory_(memory),
          of_first_(momenta.size()),
          of_last_(momenta.size()) {}

    /// Replaces the adjoints of the momenta after the series by those of the momenta before it, and adds to those of
    /// masses, and of the particles' positions, masses and affine fields. Those of affine fields, stresses and, unless
    /// the transfer blends, velocities begin here. \see p2g_back
    template <class Execution>
    void go(const Execution& execution, SparseGrid<S, D>& bars) {
        for (const SetOfSeries<S, D>& of : sets_) {
            clear(of.bar.affine, of), clear(of.bar.stress, of);
            if (!blends_velocities<Transfer>) clear(of.bar.velocity, of);
        }
        if (series_.terms.empty()) return;
        product_back(bars);
        for (std::size_t j = series_.terms.size(); j-- > 0;) term_back(execution, series_.terms[j]);
        for_nodes(adjoints_, threads_, [&](S* node, std::size_t i) {
            set(node, vector_at(of_first_.data() + i) + vector_at(of_last_.data() + i));
        });
        walls_back(momenta_);
        for_nodes(bars, threads_, [&](S* node, std::size_t i) {
            P r[4], of_walls[4];
            const Vec<P, D> bar = load_node_vectors<D>(node, r),
                            before_walls = load_node_vectors<D>(adjoints_.nodes(0) + i, of_walls);
            set(node, where_matter(mass_at(momenta_.data() + i), bar + before_walls),
                r[node_mass] + of_walls[node_mass]);
        });
        divide_by_masses_back(threads_, bars, momenta_.data(), bars.nodes(0));
    }

private:
    /// Sets one field of a set to 0.
    static void clear(const BlockedSpan<S>& field, const SetOfSeries<S, D>& of) {
        std::fill_n(field.at(0, 0), of.set.partition.slots() * std::size_t(field.components), S(0));
    }
    /// Returns a vector; 0 at nodes without matter.
    FIRN_INLINE static Vec<P, D> where_matter(const P& mass, const Vec<P, D>& a) {
        return select(mass > P(0), a, Vec<P, D>::zero());
    }
    FIRN_INLINE static Vec<P, D> vector_at(const S* node) {
        P r[4];
        return load_node_vectors<D>(node, r);
    }
    FIRN_INLINE static P mass_at(const S* node) {
        P r[4];
        load_quads(node, r);
        return r[node_mass];
    }
    /// Sets the numbers of a register of nodes.
    FIRN_INLINE static void set(S* node, const Vec<P, D>& vector, const P& fourth = P(0)) {
        P r[4] = {P(0), P(0), P(0), fourth};
        store_node_vectors(vector, r, node);
    }
    void copy(const aligned_vector<S>& from, SparseGrid<S, D>& to) const {
        copy_and_fill(from.data(), from.size(), to.nodes(0), from.size(), S(0), threads_);
    }

    /// The product of the velocity of the series and the mass backwards. The velocity is v + (before − first) with
    /// mirrored walls, v without: the adjoint of v goes to of_last_, that of v_1 after the walls to of_first_, and that
    /// of v_1 before them to `bars`.
    void product_back(SparseGrid<S, D>& bars) {
        const bool is_mirrored = !mirrors_.planes.empty();
        for_nodes(bars, threads_, [&](S* node, std::size_t i) {
            P r[4], of[4];
            const Vec<P, D> bar = load_node_vectors<D>(node, r),
                            momentum = load_node_vectors<D>(series_.refined.data() + i, of);
            const P mass = of[node_mass];
            const Vec<P, D> of_velocity = where_matter(mass, bar * mass), none = Vec<P, D>::zero();
            set(node, is_mirrored ? of_velocity : none, r[node_mass] + dot(bar, momentum) * inverse_mass(mass));
            set(of_last_.data() + i, of_velocity);
            set(of_first_.data() + i, is_mirrored ? -of_velocity : none);
        });
    }
    /// The way from v_j to v_{j+1} backwards: replaces the adjoint of v_{j+1} in of_last_ by that of v_j.
    template <class Execution>
    void term_back(const Execution& execution, const typename SeriesOfNodes<S>::Term& term) {
        copy(term.carried, values_);
        velocities_of_momenta(threads_, values_, mirrors_);
        next_back(term);
        walls_back(term.carried);
        divide_by_masses_back(threads_, adjoints_, term.carried.data(), adjoints_.nodes(0));
        copy(term.velocities, values_);
        std::vector<ParticleSet<RecordView<MotionOf<S, D>>>> records;
        for (std::size_t k = 0; k < sets_.size(); ++k) {
            particles_back(sets_[k], memory_.velocities[k]);
            records.push_back({{sets_[k].set.view.position, sets_[k].records}, sets_[k].set.partition});
        }
        p2g<Kernel, RecordTransfer, NoForceNoField>(execution, adjoints_, 0.0,
                                                    ParticleSets<RecordView<MotionOf<S, D>>>(records));
        for_nodes(adjoints_, threads_, [&](S* node, std::size_t i) {
            S* const of_last = of_last_.data() + i;
            set(of_last, vector_at(of_last) + vector_at(node));
        });
    }
    /// Transfer::next() backwards, where values_ holds A v_j. The adjoint of A v_j goes to adjoints_.
    void next_back(const typename SeriesOfNodes<S>::Term& term) {
        for_nodes(adjoints_, threads_, [&](S* node, std::size_t i) {
            S *const of_first = of_first_.data() + i, *const of_last = of_last_.data() + i;
            Tape<P>& tape = Tape<P>::mine();
            tape.cut(1);
            const Vec<T, D> v_1 = inputs(vector_at(series_.terms[0].velocities.data() + i)),
                            v_j = inputs(vector_at(term.velocities.data() + i)),
                            there_and_back = inputs(vector_at(values_.nodes(0) + i));
            const Vec<T, D> next = Transfer::next(v_1, v_j, there_and_back);
            tape.begin();
            seed(next, where_matter(mass_at(term.carried.data() + i), vector_at(of_last)));
            tape.back();
            set(of_last, adjoint_of(v_j));
            set(of_first, vector_at(of_first) + adjoint_of(v_1));
            set(node, adjoint_of(there_and_back));
        });
    }
    /// Mirrored walls backwards: replaces the adjoints of velocities in adjoints_ after they have acted by those
    /// before.
    /// \param momenta  the momenta and masses that make the velocities
    void walls_back(const aligned_vector<S>& momenta) {
        if (mirrors_.planes.empty()) return;
        copy(momenta, values_);
        divide_by_masses(threads_, values_);
        std::vector<double> by_wall(mirrors_.planes.size());  // they act without friction
        mirror_nodes_back(threads_, values_, adjoints_, mirrors_, false, by_wall);
    }
    /// The way of a set's particles there and back, backwards, where values_ holds v_j and adjoints_ the adjoints of
    /// the momenta and masses that the particles gave. The records' scatter gives the adjoint of v_j.
    void particles_back(const SetOfSeries<S, D>& of, aligned_vector<S>& memory) const {
        const BlockPartition<D>& partition = of.set.partition;
        clear(of.records, of);
        MotionOf<S, D> view = of.set.view, bar = of.bar;
        view.velocity = vectors_like(view, memory, partition.slots(), threads_);
        bar.velocity = of.records;
        gather_to_set<Kernel, false, false>(
            of.set, values_, threads_, [&](const Slots& slots, const auto& sums, const auto&) FIRN_LAMBDA {
                unroll<D>([&](auto a) FIRN_LAMBDA { view.velocity.store(slots, a, sums.velocity.v[a]); });
            });
        p2g_back<Kernel, Transfer, NoForceFor<Transfer>, false>(threads_, view, bar, partition, values_,
                                                                adjoints_.nodes(0), 0.0);
        const Positions<MotionOf<S, D>> positions(values_.domain());
        parallel_for(partition.groups.size(), threads_, [&](std::size_t g, int) {
            const BlockGroup& group = partition.groups[g];
            const GroupPlaces<MotionOf<S, D>> places(view, partition, group, positions);
            const FilledArena<Kernel, S, D> velocities(values_.nodes(0), values_, partition, group, places);
            PackPlaces<Kernel, false, S, D> pack;
            for_registers<P>(
                places, group, [&](std::size_t slot) { velocities.locate(pack, places, slot); },
                [&](const Slots& slots, std::size_t slot, int lane) {
                    const P2GRecord<P, D> record{P(0), load_vector<P, D>(of.records, slots), Mat<P, D>::zero(),
                                                 Mat<P, D>::zero()};
                    const WeightSlopes<Kernel, false, P, D> weights(
                        locate<Kernel>(places.template position<P>(slot)).fraction);
                    const Vec<P, D> slope = slope_of_sums<Kernel, false>(
                        record, weights, velocities.arena.node, velocities.arena.n, pack.weights.corner + lane);
                    unroll<D>([&](auto a) FIRN_LAMBDA { add_at(bar.position, slots, a, slope.v[a]); });
                });
        });
    }

    int threads_;
    const aligned_vector<S>& momenta_;
    const SeriesOfNodes<S>& series_;
    const Mirrors& mirrors_;
    const std::vector<SetOfSeries<S, D>>& sets_;
    SparseGrid<S, D>&values_, &adjoints_;
    TransferMemory<S>& memory_;
    aligned_vector<S> of_first_, of_last_;  // adjoints of v_1, and of the term that goes back
};

}  // namespace firn::inline FIRN_BUILD::detail
