/// \file What the processes of a run tell each other.
#pragma once

#include <firn/core/exact_sum.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/execution.hpp>
#include <firn/stage/mirror_planes.hpp>

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
class SetList;

/// What sums over the grid need of the processes of a run.
class RankSums {
public:
    /// Returns whether this rank counts what happens in a block of the grid: every block is counted by one rank.
    virtual bool counts(std::size_t block) const = 0;
    /// Adds up the sums of all ranks; each rank then has the sums over all.
    virtual void merge(std::span<ExactSum> sums) const = 0;

protected:
    ~RankSums() = default;
};

/// What the processes of a run tell each other. Every function except counts() is called on all of them in the same
/// order. The functions of OneRank say what each does.
template <std::floating_point S, int D>
class RanksOf : public RankSums {
public:
    /// Returns which part of new particles this rank takes.
    virtual Share share() const = 0;
    /// Returns whether this rank gives warnings.
    virtual bool speaks() const = 0;
    /// Returns the sum of all ranks' numbers.
    virtual std::size_t sum(std::size_t here) const = 0;
    /// Returns the largest of all ranks' numbers.
    virtual double largest(double here) const = 0;
    /// Returns the text of the first rank whose text is not empty.
    virtual std::string text_of_first(const std::string& here) const = 0;
    /// Calls describe(), which throws an error, unless `right` is true on all ranks.
    virtual void require(bool right, const std::function<void()>& describe) const = 0;
    /// Before the particles of set `number` are sorted: sends them to the ranks that own their blocks.
    virtual void bring_home(const KernelFacts& kernel, SetList<S, D>& sets, std::size_t number) const = 0;
    /// After the grid was activated: finds the blocks of nodes that several ranks share.
    virtual void meet(const KernelFacts& kernel, SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
                      int threads) const = 0;
    /// After meet(): finds the copies of blocks that this rank needs from others. \see OneRank::copies_elsewhere
    virtual CopiesElsewhere copies_elsewhere(SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
                                             bool between_groups, bool acts_by_gap, int threads) const = 0;
    /// Before P2G: takes note of the mirrored walls, behind which nodes depend on those in front.
    virtual void use_mirrors(const std::vector<MirrorPlane>& planes) const = 0;
    /// Joins the reports of G2P of all ranks.
    virtual void join_reports(SetList<S, D>& sets) const = 0;
    /// After G2P: joins the reports and the largest accelerations, then calls describe(), which throws an error, unless
    /// `right` is true on all ranks.
    virtual void end_g2p(SetList<S, D>& sets, double time, bool right, double& acceleration,
                         const std::function<void()>& describe) const = 0;
    /// Returns whether a particle of set `number` was removed on another rank when the last step ended.
    virtual bool has_lost(std::size_t number) const = 0;

protected:
    ~RanksOf() = default;
};

namespace detail {
/// The same, of a class with these functions: OneRank or mpi::Ranks.
template <std::floating_point S, int D, class Ranks>
class RanksAs final : public RanksOf<S, D> {
public:
    explicit RanksAs(Ranks ranks) : ranks_(std::move(ranks)) {}

    Share share() const override { return ranks_.share(); }
    bool speaks() const override { return ranks_.speaks(); }
    std::size_t sum(std::size_t here) const override { return ranks_.sum(here); }
    double largest(double here) const override { return ranks_.largest(here); }
    std::string text_of_first(const std::string& here) const override { return ranks_.text_of_first(here); }
    void require(bool right, const std::function<void()>& describe) const override { ranks_.require(right, describe); }
    void bring_home(const KernelFacts& kernel, SetList<S, D>& sets, std::size_t number) const override {
        ranks_.bring_home(kernel, sets, number);
    }
    void meet(const KernelFacts& kernel, SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
              int threads) const override {
        ranks_.meet(kernel, grid, partitions, threads);
    }
    CopiesElsewhere copies_elsewhere(SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
                                     bool between_groups, bool acts_by_gap, int threads) const override {
        return ranks_.copies_elsewhere(grid, partitions, between_groups, acts_by_gap, threads);
    }
    void use_mirrors(const std::vector<MirrorPlane>& planes) const override { ranks_.use_mirrors(planes); }
    void join_reports(SetList<S, D>& sets) const override { ranks_.join_reports(sets); }
    void end_g2p(SetList<S, D>& sets, double time, bool right, double& acceleration,
                 const std::function<void()>& describe) const override {
        ranks_.end_g2p(sets, time, right, acceleration, describe);
    }
    bool counts(std::size_t block) const override { return ranks_.template counts<D>(block); }
    void merge(std::span<ExactSum> sums) const override { ranks_.merge(sums); }
    bool has_lost(std::size_t number) const override { return ranks_.has_lost(number); }

private:
    Ranks ranks_;
};

/// Returns what the ranks of an execution tell each other.
template <std::floating_point S, int D, class Execution>
auto all_ranks(const Execution& execution) {
    return RanksAs<S, D, decltype(ranks_of(execution))>(ranks_of(execution));
}
/// As all_ranks(), for work that neither counts nor sums, or that one process does.
template <std::floating_point S, int D>
RanksAs<S, D, OneRank> one_rank() {
    return RanksAs<S, D, OneRank>(OneRank());
}
}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
