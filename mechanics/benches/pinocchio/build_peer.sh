#!/bin/sh
# sh build_peer.sh PYTHON OUT: compiles pinocchio_rnea.cpp against the headers of the `pin` wheel of PYTHON (needs g++ and libeigen3-dev).
set -e
prefix=$("$1" -c "import pinocchio, pathlib; print(next(p for p in pathlib.Path(pinocchio.__file__).parents if p.name == 'cmeel.prefix'))")
g++ -w -std=c++17 -O3 ${MARCH:-} -DNDEBUG -I"$prefix/include" -I/usr/include/eigen3 \
    -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_LIMIT_VECTOR_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
    "$(dirname "$0")/pinocchio_rnea.cpp" -o "$2" -L"$prefix/lib" -Wl,-rpath,"$prefix/lib" -lpinocchio_default -lboost_serialization
