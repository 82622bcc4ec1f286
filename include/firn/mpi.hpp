/// \file Includes all headers for simulations on many machines, by MPI.
#pragma once

#include <firn/mpi/communicator.hpp>
#include <firn/mpi/cuts.hpp>
#include <firn/mpi/distributed.hpp>
#include <firn/mpi/session.hpp>
#include <firn/mpi/trace.hpp>
