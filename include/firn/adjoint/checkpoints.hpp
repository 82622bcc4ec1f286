/// \file Which states of a run are kept, so that the way back needs little memory and few steps are taken again.
///
/// On the way forward the number of steps is not known beforehand. Every d-th state is kept; when five eighths of the
/// checkpoints are in use, every other one is given up and d is doubled, so that few states are stored in vain. With
/// fewer than twenty checkpoints, which ones are kept is as by Wang, Moin and Iaccarino 2009, "Minimal repetition
/// dynamic checkpointing algorithm for unsteady adjoint calculation"; compare Stumm and Walther 2010. On the way back
/// the number is known, and checkpoints are placed as by Griewank and Walther 2000, "Algorithm 799: revolve". With s
/// checkpoints, no step of a run of at most C(s + r, s) steps is taken again more than r times.
///
/// Where not all of them have room in memory, the earliest are put away: on the way back they are needed last.
#pragma once

#include <firn/core/error.hpp>

#include <algorithm>
#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A place for the checkpoints that have no room in memory.
template <class State>
struct Elsewhere {
    std::size_t most = 0;  ///< the largest number of checkpoints that are put away
    /// put(state, memory) puts a state away, and gives its memory to `memory`, a new State. It returns false if there
    /// is no room, and may throw; in both cases it has changed nothing. Destroying a state that is away makes room.
    std::function<bool(State& state, State& memory)> put{};
    /// bring(state, memory) brings a state back, into the memory that is taken from `memory`. If it throws, the state
    /// is still away.
    std::function<void(State& state, State& memory)> bring{};
};

/// Checkpoints: some of the states 0, 1, … of a run; state i is that before step i.
/// \tparam State  a state; it is written again by `store(State&)`, so that its memory is used again
template <class State>
class Checkpoints {
public:
    /// \param in_memory  the largest number of checkpoints in memory, 2 or more
    /// \param elsewhere  where more of them are put
    explicit Checkpoints(std::size_t in_memory, Elsewhere<State> elsewhere = {})
        : by_strides_(in_memory + elsewhere.most >= least_for_strides),
          most_(in_memory + elsewhere.most),
          most_in_memory_(in_memory),
          elsewhere_(std::move(elsewhere)) {}

    /// Returns the index of the last checkpoint.
    std::size_t last() const { return kept_.back().index; }
    /// Returns the state of the last checkpoint.
    State& state() {
        bring(last());
        return *kept_.back().state;
    }
    /// Returns the state of the first checkpoint.
    const State& first() {
        bring(kept_.front().index);
        return *kept_.front().state;
    }
    /// Returns the largest number of checkpoints.
    std::size_t most() const { return most_; }
    /// On the way forward, lowers the largest numbers of checkpoints in memory, 2 or more, and elsewhere, because
    /// states have become larger.
    void lower_most(std::size_t in_memory, std::size_t elsewhere = 0) {
        most_in_memory_ = std::min(in_memory, most_in_memory_);
        if (in_memory + elsewhere < most_) {
            most_ = in_memory + elsewhere;
            while (by_strides_ && kept_.size() > most_for_strides()) widen();
            while (kept_.size() > most_) give_up();
        }
        std::exception_ptr failure;
        while (in_memory_now() > most_in_memory_) {
            try {
                put_away_or_give_up();
            } catch (...) {
                failure = std::current_exception();
                give_up_in_memory();
            }
        }
        free_.resize(std::min(free_.size(), most_in_memory_ - in_memory_now()));
        if (failure) std::rethrow_exception(failure);
    }

    /// On the way forward, keeps the state `index`, which follows the last one that was given; perhaps gives up another
    /// one for it. If the next state will take its place, nothing is stored before finish(). \param store  store(state)
    /// writes the state
    template <class Store>
    void keep(std::size_t index, const Store& store) {
        if (by_strides_) return keep_by_strides(index, store);
        std::size_t level = kept_.empty() ? first_level : 0;
        if (kept_.size() == most_) level = give_up();
        kept_.push_back({index, level, nullptr});
        if (kept_.size() < most_ || dispensable() < kept_.size()) finish(store);
    }
    /// Stores the last state that was given, if it is not stored yet. If there is no room for it, or something is
    /// thrown, it is given up, and so are the places for more checkpoints than there are.
    template <class Store>
    void finish(const Store& store) {
        if (kept_.back().state) return;
        bool has_room = false;
        try {
            has_room = make_room();
            if (has_room) {
                kept_.back().state = free_state();
                store(*kept_.back().state);
            }
        } catch (...) {
            have_no_more();
            throw;
        }
        if (!has_room) have_no_more();
    }
    /// Takes the last checkpoint away: take(state) may leave anything in the state.
    template <class Take>
    void take_last(const Take& take) {
        take(state());
        remove_last();
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
        while (!kept_.empty() && kept_.back().index > index) remove_last();
    }

private:
    struct Kept {
        std::size_t index, level;
        std::unique_ptr<State> state;
        bool is_away = false;

        bool is_in_memory() const { return state && !is_away; }
    };

    template <class Store>
    void keep_by_strides(std::size_t index, const Store& store) {
        if (index % stride_ != 0) return;
        while (kept_.size() >= most_for_strides()) widen();
        if (index % stride_ == 0) add(index, 0, store);
    }
    /// Returns how many states are kept on the way forward; the others are for the way back.
    std::size_t most_for_strides() const { return std::max<std::size_t>(2, most_ * 5 / 8); }
    /// Gives up every other state.
    void widen() {
        stride_ *= 2;
        for (Kept& one : kept_)
            if (one.index % stride_ != 0) release(one);
        std::erase_if(kept_, [&](const Kept& one) { return one.index % stride_ != 0; });
    }
    /// Gives up a state that is dispensable, or else the last one. \return the level of the state in its place
    std::size_t give_up() {
        std::size_t found = dispensable(), level = 0;
        if (found == kept_.size()) level = kept_[--found].level + 1;
        release(kept_[found]);
        kept_.erase(kept_.begin() + std::ptrdiff_t(found));
        return level;
    }
    template <class Store>
    void add(std::size_t index, std::size_t level, const Store& store) {
        kept_.push_back({index, level, nullptr});
        finish(store);
    }
    /// Lets the memory of a checkpoint that is given up be used again.
    void release(Kept& one) {
        if (one.is_in_memory()) free_.push_back(std::move(one.state));
    }
    void remove_last() {
        release(kept_.back());
        kept_.pop_back();
    }
    std::size_t in_memory_now() const { return std::size_t(std::ranges::count_if(kept_, &Kept::is_in_memory)); }
    /// Puts the first state in memory away, if there is no room for another. Returns whether there is room then.
    bool make_room() {
        if (!elsewhere_.put || in_memory_now() < most_in_memory_) return true;
        Kept& one = *std::ranges::find_if(kept_, &Kept::is_in_memory);
        auto memory = std::make_unique<State>();
        if (!elsewhere_.put(*one.state, *memory)) return false;
        one.is_away = true;
        free_.push_back(std::move(memory));
        return true;
    }
    void put_away_or_give_up() {
        if (!elsewhere_.put || !make_room()) give_up_in_memory();
    }
    /// Gives up a state in memory, but not the first of all, from which all others come.
    void give_up_in_memory() {
        const auto one = std::find_if(kept_.begin() + 1, kept_.end(), [](const Kept& k) { return k.is_in_memory(); });
        release(*one);
        kept_.erase(one);
    }
    /// Brings the state `index` back, if it is away.
    void bring(std::size_t index) {
        const auto one = [&] { return std::ranges::find(kept_, index, &Kept::index); };
        if (!one()->is_away) return;
        if (in_memory_now() == most_in_memory_) put_away_or_give_up();
        const auto memory = free_state();
        elsewhere_.bring(*one()->state, *memory);
        one()->is_away = false;
    }
    /// Gives up the last one, which could not be stored. From now on, there are no more than there are now.
    void have_no_more() {
        kept_.pop_back();
        most_ = std::min(most_, std::max<std::size_t>(kept_.size(), 2));
    }
    std::unique_ptr<State> free_state() {
        if (free_.empty()) return std::make_unique<State>();
        auto state = std::move(free_.back());
        free_.pop_back();
        return state;
    }
    /// Returns which checkpoint is dispensable, because a later one has a higher level; kept_.size() if none is.
    std::size_t dispensable() const {
        std::size_t highest = 0;
        for (std::size_t k = kept_.size(); k-- > 0;) {
            if (kept_[k].level < highest) return k;
            highest = std::max(highest, kept_[k].level);
        }
        return kept_.size();
    }
    /// Returns n over k, or a large number.
    static std::size_t choose(std::size_t n, std::size_t k) {
        double value = 1;
        for (std::size_t i = 1; i <= k; ++i) value = value * double(n - k + i) / double(i);
        return value < 1e15 ? std::size_t(value + 0.5) : std::size_t(1e15);
    }

    static constexpr std::size_t least_for_strides = 20;
    static constexpr std::size_t first_level = std::numeric_limits<std::size_t>::max();
    bool by_strides_;
    std::size_t most_, most_in_memory_, stride_ = 1;
    Elsewhere<State> elsewhere_;
    std::vector<Kept> kept_;
    std::vector<std::unique_ptr<State>> free_;  // in memory
};

}  // namespace firn::inline FIRN_BUILD
