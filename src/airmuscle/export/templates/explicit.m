% Explicit Runge-Kutta method of fixed step size; the last step of a segment is shortened.
function [s, status] = step(s)
  total = ceil((s.finish - s.start) / s.h - 1e-6);
  last = s.done + 1 >= total;
  if last
    reached = s.finish;
    h = s.finish - s.t;
  else
    reached = s.start + (s.done + 1) * s.h;
    h = s.h;
  end
  s.xbefore = s.x;
  s.x = advance(s, s.t, s.x, h);
  status = 3 * ~(sum(abs(s.x)) < 1e300);
  s.before = s.t;
  s.t = reached;
  s.done = s.done + 1;
  s.steps = s.steps + 1;
end

function x = advance(s, t, y, h)
  rows = @rows@;
  weights = @weights@;
  nodes = @nodes@;
  k = zeros(s.n, numel(weights));
  for stage = 1:numel(weights)
    k(:, stage) = rhs(y + h * (k * rows(stage, :)'), inputs_at(s, t + nodes(stage) * h), s.c);
  end
  x = y + h * (k * weights);
end

function x = state_at(s, time)
  if time >= s.t - @close@ || s.steps == 0
    x = s.x;
  else
    x = advance(s, s.before, s.xbefore, time - s.before);
  end
end
