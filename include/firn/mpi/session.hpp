/// \file Starts MPI, ends it, and ends all ranks if one of them fails.
#pragma once

#include <firn/mpi/communicator.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <thread>

namespace firn::inline FIRN_BUILD::mpi {

/// An object of this class starts MPI; its destructor ends MPI. Make one at the beginning of main():
///
///     int main(int argc, char** argv) {
///         firn::mpi::Session session(argc, argv);
///         …
///     }
///
/// If an exception leaves main() on any rank, its text is printed once, with the number of the rank, and all ranks end.
/// Do not catch an exception on one rank alone to return from main(): the others would wait for this rank for ever.
/// Call fail() instead.
///
/// The program may also run without `mpirun`; it then has one rank.
class [[nodiscard]] Session {
public:
    /// Starts MPI, if the program has not started it, for threads of which only the first calls MPI
    /// (MPI_THREAD_FUNNELED).
    /// \throws usage_error  if MPI has ended already, or if MPI does not allow threads
    Session(int& argc, char**& argv) {
        int begun = 0, ended = 0, level = MPI_THREAD_SINGLE;
        MPI_Initialized(&begun);
        MPI_Finalized(&ended);
        if (ended) throw usage_error("MPI has ended; a program can start it only once.");
        if (begun)
            MPI_Query_thread(&level);
        else
            MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &level);
        owns_ = !begun;
        if (level < MPI_THREAD_FUNNELED)
            throw usage_error("This MPI allows no threads (MPI_THREAD_FUNNELED). Use a build of MPI with threads.");
        before_ = std::set_terminate(on_terminate);
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;
    /// Ends MPI, if this object has started it. While an exception is on its way, all ranks are ended instead.
    ~Session() {
        if (std::uncaught_exceptions() > 0) abort_all();
        std::set_terminate(before_);
        if (owns_) MPI_Finalize();
    }

    /// Prints a text with the number of this rank on stderr, and ends all ranks with exit code 1.
    ///
    /// An error that all ranks have thrown together is printed by rank 0 alone; the others wait up to 10 s for their
    /// end. If several ranks fail of themselves at the same time, mostly one of them prints its text.
    [[noreturn]] static void fail(const std::string& text) {
        using std::chrono::milliseconds;
        int rank = 0, size = 1;
        MPI_Comm_rank(MPI_COMM_WORLD, &rank);
        MPI_Comm_size(MPI_COMM_WORLD, &size);
        const bool common = !text.empty() && text == common_error();
        // A rank that waits here is ended by the one that fails before it.
        std::this_thread::sleep_for(common && rank > 0 ? milliseconds(10'000) : milliseconds(100 * std::min(rank, 10)));
        if (common && rank == 0)
            std::fprintf(stderr, "firn: %s\n", text.c_str());
        else
            std::fprintf(stderr, "firn: rank %d of %d: %s\n", rank, size, text.c_str());
        std::fflush(stderr);
        abort_all();
    }

    /// The text of the error that all ranks have thrown together last; empty if there was none. \see throw_together
    static std::string& common_error() {
        static std::string text;
        return text;
    }

private:
    [[noreturn]] static void abort_all() {
        MPI_Abort(MPI_COMM_WORLD, 1);
        std::_Exit(1);
    }
    [[noreturn]] static void on_terminate() {
        std::string text = "the program was terminated.";
        try {
            if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
        } catch (const std::exception& failure) {
            text = failure.what();
        } catch (...) {
            text = "an exception that is no std::exception was thrown.";
        }
        fail(text);
    }

    bool owns_ = false;
    std::terminate_handler before_ = nullptr;
};

/// Throws an error of the type `Error` on all ranks, with the text of one rank. All ranks must call this function.
/// \param rank  the rank whose text counts
/// \param text  the text; that of the other ranks is ignored
template <class Error>
[[noreturn]] void throw_together(const Communicator& all, int rank, const std::string& text) {
    Session::common_error() = all.text_of(rank, text);
    throw Error(Session::common_error());
}

}  // namespace firn::inline FIRN_BUILD::mpi
