/// \file What the ranks of a run tell each other in a step: who owns which particles, reports, errors.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/exact_sum.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/io/interruption.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/near_particles.hpp>
#include <firn/mpi/session.hpp>
#include <firn/mpi/shared_copies.hpp>
#include <firn/mpi/shared_sums.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/sort/block_numbers.hpp>

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

namespace detail {

/// What a rank knows of the others, in D dimensions.
template <int D>
struct Neighbourhood {
    std::vector<Cuts<D>> cuts{};  ///< for each material, the cuts by which its particles were shared out last
    Cuts<D> current{};            ///< the cuts by which particles are shared out now
    double achieved = 1;          ///< largest number of particles of a rank when the cuts were made, over the mean
    SharedBlocks<D> shared{};     ///< the blocks that ranks share, since the last sort
    SharedCopies<D> copies{};  ///< the blocks of the domain in which groups of several ranks meet, since the last sort

    Cuts<D>& of_material(std::size_t material) {
        if (cuts.size() <= material) cuts.resize(material + 1);
        return cuts[material];
    }
};

/// All that a rank keeps from step to step.
struct RankState {
    RankState(const Communicator& ranks, bool ordered) : all(ranks), by_turn(ordered) {}

    Communicator all;
    bool by_turn;  ///< whether sums need an order
    std::tuple<Neighbourhood<2>, Neighbourhood<3>> neighbourhoods{};
    SumsMemory memory{};
    std::vector<MirrorPlane> mirrors{};  ///< mirrored walls of the boundary
    std::vector<bool> lost{};            ///< for each material, whether particles were removed when the last step ended
    bool interrupted = false;
    std::uint64_t migrations = 0;
    Trace* trace = nullptr;

    template <int D>
    Neighbourhood<D>& of() {
        return std::get<Neighbourhood<D>>(neighbourhoods);
    }
};

/// Returns the weights of the cubes in which the particles of a set lie, sorted by key.
template <std::floating_point S, int D>
void weigh(const ParticleStore<S, D>& particles, std::vector<CubeWeight>& weights) {
    BlockNumbers numbers;
    std::vector<std::uint64_t> counts;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const std::uint32_t number = numbers.number(curve_key<D>(cube_of<D>(particles.block(slot))));
        if (number == counts.size()) counts.push_back(0);
        ++counts[number];
    }
    for (std::size_t i = 0; i < counts.size(); ++i) weights.push_back({numbers.key(i), counts[i]});
}

/// Sends each particle to the rank that owns the block of its base node.
template <std::floating_point S, int D>
void send_home(const Communicator& all, const KernelFacts& kernel, ParticleStore<S, D>& particles, const Cuts<D>& cuts,
               Trace* trace) {
    std::optional<Phase> phase(std::in_place, trace, "find particles that leave");
    const std::size_t bytes = particles.record_bytes();
    std::vector<std::pair<std::uint32_t, std::int32_t>> leaving;  // slot and new rank
    std::vector<std::size_t> count_for(std::size_t(all.size()));
    BlockCoordinate<D> last{};
    int owner = cuts.owner(last);
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        BlockCoordinate<D> block = particles.block(slot);
        const Vec<S, D> place = particles.place(slot);
        for (int a = 0; a < D; ++a) block[std::size_t(a)] += int(base_node(place[a], S(kernel.base_shift))) >> 2;
        if (block != last) {
            last = block;
            owner = cuts.owner(wrapped(particles.domain(), block));
        }
        if (owner == all.rank()) continue;
        leaving.emplace_back(std::uint32_t(slot), owner);
        ++count_for[std::size_t(owner)];
    }
    std::vector<Message> outgoing;  // each allocated once, as the first messages can have most particles
    std::vector<std::size_t> message_to(count_for.size());
    for (std::size_t rank = 0; rank < count_for.size(); ++rank) {
        if (count_for[rank] == 0) continue;
        message_to[rank] = outgoing.size();
        outgoing.push_back({int(rank), {}});
        outgoing.back().bytes.reserve(count_for[rank] * bytes);
    }
    for (const auto& [slot, rank] : leaving) {
        std::vector<std::byte>& to = outgoing[message_to[std::size_t(rank)]].bytes;
        to.resize(to.size() + bytes);
        particles.write_record(slot, to.data() + to.size() - bytes);
        particles.remove(slot);
    }
    leaving = {};
    phase.emplace(trace, "exchange particles", true);
    const std::vector<Message> incoming = exchange(all, std::move(outgoing));
    phase.emplace(trace, "take particles");
    const std::size_t free = particles.slots() - particles.size();
    std::size_t count = 0;
    for (const Message& message : incoming) count += message.bytes.size() / bytes;
    // The slots of padding and of particles that have left hold the new ones: a sort follows, whatever their order.
    if (count > free) particles.reserve(particles.size() + count);
    // About as many will come next time.
    particles.keep_free(std::min(count + count / 4, (particles.size() + count) / 16));
    std::size_t slot = 0;
    for (const Message& message : incoming)
        for (std::size_t at = 0; at < message.bytes.size(); at += bytes) {
            slot = particles.free_slot(slot);
            particles.put_record(slot, message.bytes.data() + at);
        }
}

}  // namespace detail

/// What the ranks of a run tell each other. A Simulation calls these functions; on one rank firn::OneRank has them.
/// All functions are collective except share(), speaks(), state(), counts() and has_lost().
class Ranks {
public:
    /// \param state  what this rank keeps from step to step
    /// \param largest_imbalance  \see Distributed::largest_imbalance
    Ranks(detail::RankState& state, double largest_imbalance) : state_(&state), largest_imbalance_(largest_imbalance) {}

    detail::RankState& state() const { return *state_; }  ///< What this rank keeps from step to step.
    /// Returns which part of new particles this rank takes.
    Share share() const { return {std::size_t(all().rank()), std::size_t(all().size())}; }
    bool speaks() const { return all().rank() == 0; }  ///< Returns whether this rank gives warnings.
    /// Returns the sum of all ranks' numbers.
    std::size_t sum(std::size_t here) const { return std::size_t(all().sum(std::uint64_t(here))); }
    /// Returns the largest of all ranks' numbers.
    double largest(double here) const { return all().max(here); }
    /// Returns the text of the first rank whose text is not empty.
    std::string text_of_first(const std::string& here) const {
        const int first = all().min(here.empty() ? all().size() : all().rank());
        return first == all().size() ? std::string() : all().text_of(first, here);
    }
    /// Throws an error on all ranks, unless `right` is true on all of them. \param describe  throws the error
    template <class Describe>
    void require(bool right, const Describe& describe) const {
        if (all().min(right ? 1 : 0) == 0) fail(right, describe);
    }

    /// Sends the particles of set `number` to the ranks that own their blocks. If a rank has too many particles, all
    /// are shared out anew.
    template <std::floating_point S, int D>
    void bring_home(const KernelFacts& kernel, SetList<S, D>& sets, std::size_t number) const {
        if (all().size() == 1) return;
        auto& near = state_->of<D>();
        Cuts<D>& cuts = near.of_material(number);
        bool is_new = near.current.first.empty();
        if (is_new) near.current = find_cuts(sets);
        const auto send = [&] {
            cuts = near.current;
            detail::send_home(all(), kernel, sets[number].store(), cuts, state_->trace);
        };
        send();
        if (imbalance(sets) > largest_imbalance_ * near.achieved && !is_new) {
            Cuts<D> balanced = find_cuts(sets);
            is_new = true;
            if (balanced != near.current) {
                near.current = std::move(balanced);
                ++state_->migrations;
                send();
            }
        }
        if (is_new) near.achieved = std::max(1.0, imbalance(sets));
    }

    /// Finds the blocks of nodes that several ranks share, after the grid was activated.
    template <std::floating_point S, int D, class Partitions>
    void meet(const KernelFacts& kernel, SparseGrid<S, D>& grid, const Partitions& partitions, int threads) const {
        const detail::Phase phase(state_->trace, "find shared blocks");
        auto& near = state_->of<D>();
        Cuts<D> whole = near.current;
        if (whole.first.empty()) {
            whole.first.assign(std::size_t(all().size()), std::uint64_t(1) << curve_key_bits<D>);
            whole.first[0] = 0;
        }
        for (std::size_t m = 0; m < partitions.size(); ++m)
            if (near.of_material(m).first.empty()) near.of_material(m) = whole;  // a set without particles
        const std::vector<const BlockPartition<D>*> all_partitions(partitions.begin(), partitions.end());
        near.shared = detail::SharedBlocks<D>(all(), grid, all_partitions, near.cuts, kernel.colours, state_->by_turn);
        if (near.shared.blocks_behind() > 0) grid.add_blocks_behind(near.shared.blocks_behind(), threads);
    }

    /// After meet(): finds the blocks at which ranks need each other's sums and particles for contact, and the copies
    /// of blocks that this rank needs from others.
    /// \param partitions      the partitions of this rank's sets
    /// \param between_groups  whether there may be contact between groups
    /// \param acts_by_gap     whether the boundary acts by the gap of particles
    template <std::floating_point S, int D, class Partitions>
    const CopiesElsewhere& copies_elsewhere(SparseGrid<S, D>& grid, const Partitions& partitions, bool between_groups,
                                            bool acts_by_gap, int threads) const {
        const detail::Phase phase(state_->trace, "find shared copies");
        auto& near = state_->of<D>();
        near.copies = {};
        if (all().size() == 1 || !(between_groups || acts_by_gap)) return near.copies.elsewhere();
        const bool has_groups = has_contact_groups(std::span<BlockPartition<D>* const>(partitions));
        if (!acts_by_gap && all().max(has_groups ? 1 : 0) == 0) return near.copies.elsewhere();
        const std::size_t behind = near.shared.blocks_behind();
        near.copies = detail::SharedCopies<D>(all(), grid, near.cuts[0], grid.block_count() + behind, acts_by_gap);
        if (const std::size_t more = near.copies.elsewhere().keys.size(); more > 0)
            grid.add_blocks_behind(behind + more, threads);
        return near.copies.elsewhere();
    }
    /// Before contact: completes the sums in the copies of blocks that this rank shares with others.
    template <std::floating_point S, int D>
    void bring_copies(SparseGrid<S, D>& grid) const {
        const detail::Phase phase(state_->trace, "exchange sums for contact", true);
        state_->of<D>().copies.bring_sums(all(), grid);
    }
    /// Sends particles near contact to the ranks that need them. \see NearParticles::find
    template <class Kernel, int D>
    void bring_near(NearParticles<Kernel, D>& near) const {
        const detail::Phase phase(state_->trace, "exchange particles near contact", true);
        state_->of<D>().copies.bring_particles(all(), near);
    }
    /// Replaces the pairs of contact groups between which this rank has impulses, sorted, by those of all ranks.
    void join_pairs(std::vector<std::pair<int, int>>& pairs) const {
        std::vector<Message> outgoing;
        if (!pairs.empty())
            for (int rank = 0; rank < all().size(); ++rank) outgoing.push_back(message_of(rank, pairs));
        pairs.clear();
        for (const Message& message : exchange(all(), std::move(outgoing)))
            for (const auto& [first, second] : contents<std::array<int, 2>>(message)) pairs.emplace_back(first, second);
        std::sort(pairs.begin(), pairs.end());
        pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    }
    /// Joins the reports of G2P of all ranks.
    template <std::floating_point S, int D>
    void join_reports(SetList<S, D>& sets) const {
        std::vector<double> numbers;
        for (const SetOf<S, D>& set : sets)
            numbers.insert(numbers.end(), {set.report.signal_speed, double(set.report.sort_needed)});
        all().max(std::span<double>(numbers));
        read_reports(sets, numbers, 2);
    }
    /// After G2P: joins the reports and the largest accelerations, and throws an error on all ranks unless `right` is
    /// true on all of them. This is the one reduction over all ranks in a step.
    /// \param acceleration  the largest acceleration on this rank; receives that on all ranks [m/s²]
    template <std::floating_point S, int D, class Describe>
    void end_g2p(SetList<S, D>& sets, double time, bool right, double& acceleration, const Describe& describe) const {
        const detail::Phase phase(state_->trace, "join reports", true);
        std::vector<double> numbers;
        for (const SetOf<S, D>& set : sets)
            numbers.insert(numbers.end(), {set.report.signal_speed, double(set.report.sort_needed),
                                           double(right && set.will_take(time))});
        const std::size_t sets_count = numbers.size() / 3, of_run = numbers.size();
        numbers.insert(numbers.end(), {right ? 0.0 : 1.0, acceleration, Interruption::raised() ? 1.0 : 0.0});
        all().max(std::span<double>(numbers));
        read_reports(sets, numbers, 3);
        state_->lost.assign(sets_count, false);
        for (std::size_t m = 0; m < sets_count; ++m) state_->lost[m] = numbers[3 * m + 2] > 0;
        acceleration = numbers[of_run + 1];
        state_->interrupted = numbers[of_run + 2] > 0;
        if (numbers[of_run] > 0) fail(right, describe);
    }
    /// Before P2G: takes note of the mirrored walls. A rank whose particles reach a node beside such a wall needs the
    /// sums of the nodes on both sides of the wall.
    void use_mirrors(const std::vector<MirrorPlane>& planes) const { state_->mirrors = planes; }
    /// Adds up the sums of all ranks; each rank then has the sums over all.
    void merge(std::span<ExactSum> sums) const {
        for (ExactSum& sum : sums) sum.normalise();
        all().sum(digits_of(sums));
        for (ExactSum& sum : sums) sum.normalise();
    }
    /// Returns whether this rank counts what happens in a block of the grid: every block is counted by one rank.
    template <int D>
    bool counts(std::size_t block) const {
        return state_->of<D>().shared.counts(block);
    }
    /// Returns whether a particle of set `number` was removed on any rank when the last step ended.
    bool has_lost(std::size_t number) const { return number < state_->lost.size() && state_->lost[number]; }

private:
    const Communicator& all() const { return state_->all; }

    template <class Describe>
    [[noreturn]] void fail(bool right, const Describe& describe) const {
        std::string text;
        if (!right) {
            try {
                describe();
            } catch (const std::exception& failure) {
                text = sentence("Rank ", all().rank(), " of ", all().size(), ": ", failure.what());
            }
        }
        throw_together<particle_error>(all(), all().min(right ? all().size() : all().rank()), text);
    }

    template <std::floating_point S, int D>
    Cuts<D> find_cuts(const SetList<S, D>& sets) const {
        const detail::Phase phase(state_->trace, "find cuts");
        std::vector<CubeWeight> weights;
        for (const SetOf<S, D>& set : sets) detail::weigh(set.store(), weights);
        std::sort(weights.begin(), weights.end());
        return balanced_cuts<D>(std::span<const CubeWeight>(weights), all().size(),
                                [&](std::span<std::uint64_t> numbers) { all().sum(numbers); });
    }
    /// Returns the largest number of particles of a rank, divided by the mean.
    template <std::floating_point S, int D>
    double imbalance(const SetList<S, D>& sets) const {
        const detail::Phase phase(state_->trace, "compare loads", true);
        std::uint64_t here = 0;
        for (const SetOf<S, D>& set : sets) here += set.store().size();
        const auto most = all().max(here), whole = all().sum(here);
        return whole == 0 ? 1 : double(most) * all().size() / double(whole);
    }

    template <std::floating_point S, int D>
    static void read_reports(SetList<S, D>& sets, const std::vector<double>& numbers, std::size_t of_each) {
        for (std::size_t k = 0; k < sets.size(); ++k) {
            sets[k].report.signal_speed = numbers[k * of_each];
            sets[k].report.sort_needed = numbers[k * of_each + 1] > 0;
        }
    }

    detail::RankState* state_;
    double largest_imbalance_;
};

}  // namespace firn::inline FIRN_BUILD::mpi
