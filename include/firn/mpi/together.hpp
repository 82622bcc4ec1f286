/// \file Errors of one rank that all ranks throw together.
#pragma once

#include <firn/core/error.hpp>
#include <firn/mpi/session.hpp>

#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD::mpi::detail {

/// What became of something that every rank tried: nothing, or an error. The ranks go on and take part in what the
/// others do, until settle() throws the error on all of them.
class Outcome {
public:
    explicit Outcome(const Communicator& all) : all_(all) {}

    bool failed() const { return kind_ != none; }  ///< Whether this rank has failed.

    /// Calls f(), unless this rank has failed, and notes an error of firn that it throws.
    template <class F>
    void attempt(const F& f) {
        if (failed()) return;
        try {
            f();
        } catch (const parameter_error& failure) {
            note(parameter, failure);
        } catch (const particle_error& failure) {
            note(particle, failure);
        } catch (const usage_error& failure) {
            note(usage, failure);
        } catch (const io_error& failure) {
            note(io, failure);
        }
    }

    /// Throws the error of the lowest rank that has failed on all ranks, with the number of that rank; without it if
    /// all ranks have failed. Collective.
    void settle() const {
        const int first = all_.min(failed() ? all_.rank() : all_.size());
        if (first == all_.size()) return;
        const int failures = all_.sum(failed() ? 1 : 0);
        const int kind = all_.max(all_.rank() == first ? int(kind_) : 0);
        const std::string text = failures == all_.size() || text_.starts_with("Rank ")
                                     ? text_
                                     : sentence("Rank ", first, " of ", all_.size(), ": ", text_);
        switch (kind) {
            case parameter:
                throw_together<parameter_error>(all_, first, text);
            case particle:
                throw_together<particle_error>(all_, first, text);
            case usage:
                throw_together<usage_error>(all_, first, text);
            default:
                throw_together<io_error>(all_, first, text);
        }
    }

private:
    enum Kind : int { none, parameter, particle, usage, io };
    void note(Kind kind, const std::exception& failure) {
        kind_ = kind;
        text_ = failure.what();
    }

    const Communicator& all_;
    Kind kind_ = none;
    std::string text_;
};

/// Returns f(). If f() throws an error of firn on any rank, all ranks throw it. Collective.
template <class F>
auto together(const Communicator& all, const F& f) {
    Outcome outcome(all);
    if constexpr (std::is_void_v<decltype(f())>) {
        outcome.attempt(f);
        outcome.settle();
    } else {
        std::optional<decltype(f())> result;
        outcome.attempt([&] { result.emplace(f()); });
        outcome.settle();
        return std::move(*result);
    }
}

}  // namespace firn::inline FIRN_BUILD::mpi::detail
