function model = @file@()
@provenance@%
% model = @file@() describes the system: names, units and defaults of its arrays, and its functions
%   c = model.prepare(p)          what the functions need of the parameters p
%   f = model.rates(x, u, c)      rates of the states x under the inputs u
%   o = model.outputs(x, u, c)    outputs
%   r = model.simulate(changes)   a run: columns r.data with the names r.names, r.status (0: complete), r.steps
% changes may have the fields parameters, initial, start, ends, values, slopes and times; the others are those of the
% exported run, model.run.
@constants@  model.prepare = @prepare;
  model.rates = @rhs;
  model.outputs = @outputs;
  model.simulate = @(varargin) simulate(model, varargin{:});
end

function r = simulate(model, changes)
  run = model.run;
  run.parameters = model.defaults;
  if nargin > 1
    given = fieldnames(changes);
    for k = 1:numel(given)
      run.(given{k}) = changes.(given{k});
    end
  end
  s.c = prepare(run.parameters);
  s.n = numel(model.states);
  s.nominal = model.nominal;
  s.t = run.start;
  s.before = run.start;
  s.x = run.initial(:);
  s.xbefore = s.x;
  s.taken = 0;
  s.steps = 0;
  s.rejected = 0;
  times = run.times(:);
  count = numel(times);
  data = zeros(count, 1 + numel(model.states) + numel(model.inputs) + numel(model.output_names));
  row = 1;
  status = 0;
  for k = 1:numel(run.ends)
    s.start = s.t;
    s.finish = run.ends(k);
    s.u = run.values(k, :)';
    s.w = run.slopes(k, :)';
    s.done = 0;
    s.h = @first_step@;
    [data, row] = write_rows(data, row, times, s.t + @close@, s);
    while s.t < s.finish && status == 0
      [s, status] = step(s);
      if status == 0 && s.t < s.finish
        [data, row] = write_rows(data, row, times, s.t + @close@, s);
      end
    end
    if status ~= 0
      break
    end
    % the row at the end of a segment has the inputs of the next one
    while row <= count && times(row) < s.finish - @close@
      [data, row] = write_rows(data, row, times, times(row), s);
    end
  end
  if status == 0
    [data, row] = write_rows(data, row, times, s.t + @close@, s);
  end
  r.names = [{'time'}, model.states, model.inputs, model.output_names];
  r.data = data(1:row - 1, :);
  r.status = status;
  r.time = s.t;
  r.steps = s.steps;
  r.rejected = s.rejected;
end

function [data, row] = write_rows(data, row, times, limit, s)
  while row <= numel(times) && times(row) <= limit
    x = state_at(s, times(row));
    u = inputs_at(s, times(row));
    data(row, :) = [times(row); x; u; outputs(x, u, s.c)]';
    row = row + 1;
  end
end

function u = inputs_at(s, time)
  u = s.u + (time - s.start) * s.w;
end

% Solver
@solver@
% Printed functions: J the distinct non-zeros of df/dx, A the LU factors of d I - J
@functions@
