#include <firn/mpi/session.hpp>

int main(int argc, char** argv) {
    firn::mpi::Session session(argc, argv);
    const firn::mpi::Communicator ranks;
    return ranks.sum(1) == 1 && ranks.size() == 1 ? 0 : 1;
}
