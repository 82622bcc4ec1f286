/// \file firn_mpi_failing HOW RANK FOLDER: a program whose rank RANK fails while the others wait for it; run.sh says
/// how. Each rank leaves a file in FOLDER whose name is its process id.
#include <firn/mpi/session.hpp>

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <stdexcept>
#include <thread>

int main(int argc, char** argv) {
    const std::string how = argc > 1 ? argv[1] : "";
    if (how == "no_session") {
        try {
            const firn::mpi::Communicator none;
        } catch (const firn::usage_error& refused) {
            std::printf("%s\n", refused.what());
            return 3;
        }
        return 0;
    }

    firn::mpi::Session session(argc, argv);
    const firn::mpi::Communicator ranks;
    const int failing = std::stoi(argv[2]);
    std::ofstream(std::string(argv[3]) + "/" + std::to_string(getpid()));
    ranks.barrier();
    if (how == "together" || how == "together_late") {
        try {
            firn::mpi::throw_together<firn::usage_error>(ranks, failing, "All ranks agree.");
        } catch (const firn::usage_error&) {
            // On a busy machine rank 0 may come long after the others, which leave the message to it.
            if (how == "together_late" && ranks.rank() == 0) {
                std::this_thread::sleep_for(std::chrono::seconds(1));
                std::fprintf(stderr, "Rank 0 comes last.\n");
            }
            throw;
        }
    }
    if (ranks.rank() == failing) {
        if (how == "throw") throw firn::usage_error("This rank gives up.");
        if (how == "throw_other") throw 7;
        if (how == "throw_in_thread") std::thread([] { throw std::runtime_error("A thread gives up."); }).join();
        if (how == "fail") firn::mpi::Session::fail("This rank cannot go on.");
        if (how == "kill") std::raise(SIGKILL);
        if (how == "crash") std::raise(SIGSEGV);
    }
    // The others compute, and wait for the one that failed.
    std::uint64_t steps = 0;
    if (how != "nothing")
        for (;;) steps = ranks.max(steps + 1);
    if (ranks.rank() == 0)
        std::printf("%d ranks, sum %d\n", ranks.size(), ranks.sum(1));
    else
        ranks.sum(1);
    return 0;
}
