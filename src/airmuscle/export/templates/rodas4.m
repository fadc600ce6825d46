% Rodas4: Rosenbrock method of order four, adaptive. Hairer and Wanner (1996), section VI.4, method RODAS.
function [s, status] = step(s)
  status = 0;
  u = inputs_at(s, s.t);
  [f0, J] = jac(s.x, u, s.c);
  ft = zeros(s.n, 1);
  if any(s.w)
    ft = df_dt(s.x, u, s.c, s.w);
  end
  if s.h <= 0
    scale = @rtol@ * s.nominal + @rtol@ * abs(s.x);
    rate = sum((f0 ./ scale) .^ 2);
    s.h = s.finish - s.t;
    if rate > 0
      s.h = min(s.h, 0.1 * sqrt(sqrt(@rtol@)) * sqrt((sum((s.x ./ scale) .^ 2) + 1) / rate));
    end
  end
  rejected = false;
  while true
    last = s.t + 1.000001 * s.h >= s.finish;
    if last
      s.h = s.finish - s.t;
    end
    [new, error, dense] = attempt(s, s.h, f0, ft, J);
    if ~(error < 1e300)
      change = 0.5;
    else
      change = min(6, max(0.2, 0.9 / sqrt(sqrt(error))));
      if error <= 1
        break
      end
    end
    rejected = true;
    s.rejected = s.rejected + 1;
    s.h = s.h * change;
    if s.h < 1e-14 * max(abs(s.t), s.finish - s.start)
      status = 2 + ~(error < 1e300);
      return
    end
  end
  s.xbefore = s.x;
  s.x = new;
  s.dense = dense;
  s.before = s.t;
  s.taken = s.h;
  if last
    s.t = s.finish;
  else
    s.t = s.t + s.h;
  end
  s.steps = s.steps + 1;
  if rejected
    change = min(change, 1);
  end
  s.h = s.h * change;
end

function [new, error, dense] = attempt(s, h, f0, ft, J)
  y = s.x;
  c = s.c;
  r = 1 / h;
  A = factor(J, r / (@GAMMA@));
  k1 = solve(A, f0 + h * (@D1@) * ft);
  u = inputs_at(s, s.t + (@N2@) * h);
  k2 = stage(y + (@A21@) * k1, u, c, A, r * (@C21@) * k1 + h * (@D2@) * ft);
  u = inputs_at(s, s.t + (@N3@) * h);
  k3 = stage(y + (@A31@) * k1 + (@A32@) * k2, u, c, A, r * ((@C31@) * k1 + (@C32@) * k2) + h * (@D3@) * ft);
  u = inputs_at(s, s.t + (@N4@) * h);
  g = r * ((@C41@) * k1 + (@C42@) * k2 + (@C43@) * k3) + h * (@D4@) * ft;
  k4 = stage(y + (@A41@) * k1 + (@A42@) * k2 + (@A43@) * k3, u, c, A, g);
  u = inputs_at(s, s.t + h);
  x = y + (@A51@) * k1 + (@A52@) * k2 + (@A53@) * k3 + (@A54@) * k4;
  k5 = stage(x, u, c, A, r * ((@C51@) * k1 + (@C52@) * k2 + (@C53@) * k3 + (@C54@) * k4));
  x = x + k5;
  k6 = stage(x, u, c, A, r * ((@C61@) * k1 + (@C62@) * k2 + (@C63@) * k3 + (@C64@) * k4 + (@C65@) * k5));
  new = x + k6;
  scale = @rtol@ * s.nominal + @rtol@ * max(abs(y), abs(new));
  error = sqrt(sum((k6 ./ scale) .^ 2) / s.n) + 1e-16;
  dense = [(@H21@) * k1 + (@H22@) * k2 + (@H23@) * k3 + (@H24@) * k4 + (@H25@) * k5, ...
           (@H31@) * k1 + (@H32@) * k2 + (@H33@) * k3 + (@H34@) * k4 + (@H35@) * k5];
end

function x = state_at(s, time)
  x = s.x;
  if s.taken > 0 && time < s.t
    q = (time - s.before) / s.taken;
    x = s.xbefore * (1 - q) + q * (s.x + (1 - q) * (s.dense(:, 1) + q * s.dense(:, 2)));
  end
end
