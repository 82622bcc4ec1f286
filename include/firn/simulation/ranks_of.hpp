/// \file What the processes of a run tell each other.
#pragma once

#include <firn/core/exact_sum.hpp>
#include <firn/data/kernel_facts.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/loops/execution.hpp>
#include <firn/stage/mirror.hpp>

#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
class SetList;

/// What the processes of a run tell each other. Every function is called on all of them in the same order. The
/// functions of OneRank say what each does.
template <std::floating_point S, int D>
class RanksOf {
public:
    virtual Share share() const = 0;
    virtual bool speaks() const = 0;
    virtual std::size_t sum(std::size_t here) const = 0;
    virtual double largest(double here) const = 0;
    virtual std::string text_of_first(const std::string& here) const = 0;
    virtual void require(bool right, const std::function<void()>& describe) const = 0;
    virtual void bring_home(const KernelFacts& kernel, SetList<S, D>& sets, std::size_t number) const = 0;
    virtual void meet(const KernelFacts& kernel, SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
                      int threads) const = 0;
    virtual CopiesElsewhere copies_elsewhere(SparseGrid<S, D>& grid, std::span<BlockPartition<D>* const> partitions,
                                             bool between_groups, bool acts_by_gap, int threads) const = 0;
    virtual void use_mirrors(const std::vector<MirrorPlane>& planes) const = 0;
    virtual void join_reports(SetList<S, D>& sets) const = 0;
    virtual void end_g2p(SetList<S, D>& sets, double time, bool right, double& acceleration,
                         const std::function<void()>& describe) const = 0;
    virtual void merge(std::span<ExactSum> sums) const = 0;
    virtual bool has_lost(std::size_t number) const = 0;

protected:
    ~RanksOf() = default;
};

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
    void merge(std::span<ExactSum> sums) const override { ranks_.merge(sums); }
    bool has_lost(std::size_t number) const override { return ranks_.has_lost(number); }

private:
    Ranks ranks_;
};

}  // namespace firn::inline FIRN_BUILD
