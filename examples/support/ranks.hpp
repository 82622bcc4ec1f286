/// \file What an example on several ranks of MPI needs besides firn: one voice, and threads that fit on the machine.
#pragma once

#include <firn/mpi/communicator.hpp>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <thread>

namespace example {

/// A guard: while an object of this class exists, std::cout and std::cerr print on rank 0 alone.
class OneSpeaks {
public:
    explicit OneSpeaks(const firn::mpi::Communicator& ranks) : out_(std::cout.rdbuf()), error_(std::cerr.rdbuf()) {
        if (ranks.rank() == 0) return;
        std::cout.rdbuf(nullptr);
        std::cerr.rdbuf(nullptr);
    }
    OneSpeaks(const OneSpeaks&) = delete;
    OneSpeaks& operator=(const OneSpeaks&) = delete;
    ~OneSpeaks() {
        std::cout.rdbuf(out_);
        std::cerr.rdbuf(error_);
    }

private:
    std::streambuf *out_, *error_;
};

/// Returns how many threads each rank may have: OMP_NUM_THREADS, or else the processors of this machine, divided among
/// the ranks that run on it.
inline int threads_of_rank(const firn::mpi::Communicator& ranks) {
    if (const char* asked = std::getenv("OMP_NUM_THREADS"); asked && std::atoi(asked) > 0) return std::atoi(asked);
    MPI_Comm here = MPI_COMM_NULL;  // the ranks on this machine
    MPI_Comm_split_type(ranks.get(), MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
    int count = 1;
    MPI_Comm_size(here, &count);
    MPI_Comm_free(&here);
    return std::max(1, int(std::thread::hardware_concurrency()) / count);
}

}  // namespace example
