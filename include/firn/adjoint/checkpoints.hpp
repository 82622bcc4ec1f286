/// \file Which states of a run are kept, so that the way back needs little memory and few steps are taken again.
///
/// On the way forward the number of steps is not known beforehand: Wang, Moin and Iaccarino 2009, "Minimal repetition
/// dynamic checkpointing algorithm for unsteady adjoint calculation"; compare Stumm and Walther 2010. On the way back
/// it is, and checkpoints are placed as by Griewank and Walther 2000, "Algorithm 799: revolve". With s checkpoints, no
/// step of a run of at most C(s + r, s) steps is taken again more than r times.
#pragma once

#include <firn/core/error.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Checkpoints: some of the states 0, 1, … of a run; state i is that before step i.
/// \tparam State  a state; it is written again by `store(State&)`, so that its memory is used again
template <class State>
class Checkpoints {
public:
    /// \param most  the largest number of checkpoints, 2 or more
    explicit Checkpoints(std::size_t most) : most_(most) {}

    /// Returns the index of the last checkpoint.
    std::size_t last() const { return kept_.back().index; }
    /// Returns the state of the last checkpoint.
    const State& state() const { return *kept_.back().state; }
    /// Returns whether there is none.
    bool empty() const { return kept_.empty(); }
    /// Returns the largest number of checkpoints.
    std::size_t most() const { return most_; }

    /// On the way forward, keeps the state `index`, which follows the last one that was given; perhaps gives up another
    /// one for it. \param store  store(state) writes the state
    template <class Store>
    void keep(std::size_t index, const Store& store) {
        std::size_t level = kept_.empty() ? first_level : 0;
        if (kept_.size() == most_) {
            // One is dispensable if a later one has a higher level.
            std::size_t highest = 0, found = kept_.size();
            for (std::size_t k = kept_.size(); k-- > 0;) {
                if (kept_[k].level < highest) {
                    found = k;
                    break;
                }
                highest = std::max(highest, kept_[k].level);
            }
            if (found == kept_.size()) {
                found = kept_.size() - 1;
                level = kept_[found].level + 1;
            }
            free_.push_back(std::move(kept_[found].state));
            kept_.erase(kept_.begin() + std::ptrdiff_t(found));
        }
        add(index, level, store);
    }
    /// On the way back, returns how far to go from the last checkpoint towards the state `wanted`, behind which all are
    /// done. If the way ends before, that state is to be kept. \see keep_again
    std::size_t way_to(std::size_t wanted) const {
        if (kept_.size() == most_) return wanted;
        const std::size_t steps = wanted - last() + 1, free = most_ - kept_.size();
        std::size_t again = 0;
        while (choose(free + 1 + again, again) < steps) ++again;
        const std::size_t behind = choose(free + again, again);
        return std::min(wanted, last() + std::max<std::size_t>(1, steps - std::min(steps, behind)));
    }
    /// On the way back, keeps the state `index` if there is room.
    template <class Store>
    void keep_again(std::size_t index, const Store& store) {
        if (kept_.size() < most_) add(index, 0, store);
    }
    /// Gives up the checkpoints behind state `index`.
    void forget_behind(std::size_t index) {
        while (!kept_.empty() && kept_.back().index > index) {
            free_.push_back(std::move(kept_.back().state));
            kept_.pop_back();
        }
    }

private:
    template <class Store>
    void add(std::size_t index, std::size_t level, const Store& store) {
        if (free_.empty()) free_.push_back(std::make_unique<State>());
        store(*free_.back());
        kept_.push_back({index, level, std::move(free_.back())});
        free_.pop_back();
    }
    /// Returns n over k, or a large number.
    static std::size_t choose(std::size_t n, std::size_t k) {
        double value = 1;
        for (std::size_t i = 1; i <= k; ++i) value = value * double(n - k + i) / double(i);
        return value < 1e15 ? std::size_t(value + 0.5) : std::size_t(1e15);
    }

    static constexpr std::size_t first_level = std::numeric_limits<std::size_t>::max();
    struct Kept {
        std::size_t index, level;
        std::unique_ptr<State> state;
    };

    std::size_t most_;
    std::vector<Kept> kept_;
    std::vector<std::unique_ptr<State>> free_;
};

}  // namespace firn::inline FIRN_BUILD
