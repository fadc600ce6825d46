@wp.func
def log1p(x: real):
    u = real(1.0) + x
    return wp.where(u == real(1.0), x, wp.log(u) * x / (u - real(1.0)))


@wp.func
def expm1(x: real):
    u = wp.exp(x)
    less = u - real(1.0)
    small = wp.where(u == real(1.0), x, less * x / wp.log(u))
    return wp.where(less == real(-1.0), less, small)


@wp.func
def asinh(x: real):
    size = wp.abs(x)
    return wp.sign(x) * log1p(size + x * x / (real(1.0) + wp.sqrt(real(1.0) + x * x)))
